#include "worker/render/light/light_bounds.h"

#include "worker/render/sampler/elementary.h"
#include "worker/render/sampler/warp.h"

namespace relume::render {
namespace {

float AngleBetween(Vec3f a, Vec3f b) { return Atan2(Length(Cross(a, b)), Dot(a, b)); }

// The smallest cone about two others, into `out`.
void UniteCones(const LightExtent& a, const LightExtent& b, LightExtent* out) {
    const LightExtent& wide = a.spread >= b.spread ? a : b;
    const LightExtent& narrow = a.spread >= b.spread ? b : a;
    out->axis = wide.axis;
    out->spread = wide.spread;
    const float between = AngleBetween(wide.axis, narrow.axis);
    if (std::min(between + narrow.spread, kPi) <= wide.spread) {
        return;
    }
    const float spread = 0.5f * (wide.spread + between + narrow.spread);
    const Vec3f across = narrow.axis - wide.axis * Dot(narrow.axis, wide.axis);
    const float length = Length(across);
    if (spread >= kPi || !(length > 1e-6f)) {
        out->spread = kPi;
        return;
    }
    const SinCos turn = SinCosTurn((spread - wide.spread) * (0.5f * kInvPi));
    out->axis = Normalize(wide.axis * turn.cos + across * (turn.sin / length));
    out->spread = spread;
}

}  // namespace

LightExtent Unite(const LightExtent& a, const LightExtent& b) {
    if (!(a.strength > 0)) {
        return b;
    }
    if (!(b.strength > 0)) {
        return a;
    }
    LightExtent out;
    out.box = a.box;
    out.box.Add(b.box.lower);
    out.box.Add(b.box.upper);
    UniteCones(a, b, &out);
    out.reach = std::max(a.reach, b.reach);
    out.strength = a.strength + b.strength;
    out.both_sides = a.both_sides || b.both_sides;
    return out;
}

LightBounds::LightBounds(const LightExtent& extent)
    : center(extent.box.center()),
      radius2(0.25f * Length2(extent.box.upper - extent.box.lower)),
      axis(extent.axis),
      strength(extent.strength),
      both_sides(extent.both_sides) {
    // A hair wider, against the rounding of directions.
    constexpr float kMargin = 1e-5f;
    const float spread = std::min(extent.spread + kMargin, kPi);
    const SinCos cone = SinCosTurn(spread * (0.5f * kInvPi));
    cos_spread = spread >= kPi ? -1 : cone.cos;
    sin_spread = spread >= kPi ? 0 : cone.sin;
    const SinCos end = SinCosTurn(extent.reach * (0.5f * kInvPi));
    cos_reach = std::max(end.cos, 0.0f);
}

}  // namespace relume::render
