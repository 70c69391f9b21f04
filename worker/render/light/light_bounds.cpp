#include "worker/render/light/light_bounds.h"

#include <immintrin.h>

#include <algorithm>

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

void LightGroup::Set(std::size_t i, const LightExtent& extent) {
    const Vec3f center = extent.box.center();
    x_[i] = center.x;
    y_[i] = center.y;
    z_[i] = center.z;
    radius2_[i] = std::max(0.25f * Length2(extent.box.upper - extent.box.lower), 1e-30f);
    axis_x_[i] = extent.axis.x;
    axis_y_[i] = extent.axis.y;
    axis_z_[i] = extent.axis.z;
    // A hair wider, against the rounding of directions.
    constexpr float kMargin = 1e-5f;
    const float spread = extent.spread + kMargin;
    const SinCos cone = SinCosTurn(std::min(spread, kPi) * (0.5f * kInvPi));
    cos_spread_[i] = spread >= kPi ? -1 : cone.cos;
    sin_spread_[i] = spread >= kPi ? 0 : cone.sin;
    cos_reach_[i] = std::max(SinCosTurn(extent.reach * (0.5f * kInvPi)).cos, 0.0f);
    strength_[i] = extent.strength;
    both_sides_[i] = extent.both_sides ? 1 : 0;
}

Float8 LightGroup::Importance(const LightReceiver& at) const {
    const Float8 zero{}, one = zero + 1;
    const auto root = [](Float8 v) { return static_cast<Float8>(_mm256_sqrt_ps(v)); };
    const auto larger = [](Float8 a, Float8 b) { return a > b ? a : b; };
    const auto magnitude = [&](Float8 v) { return larger(v, -v); };
    const Float8 dx = x_ - at.point.x, dy = y_ - at.point.y, dz = z_ - at.point.z;
    // From within the sphere light may come from all around: its half angle is pi then.
    const Float8 distance2 = dx * dx + dy * dy + dz * dz;
    const auto inside = distance2 <= radius2_;
    const Float8 square = inside ? radius2_ : distance2;
    const Float8 sin2 = radius2_ / square;
    const Float8 sin_sphere = inside ? zero : root(sin2);
    const Float8 cos_sphere = inside ? -one : root(larger(one - sin2, zero));
    const Float8 scale = one / root(square);

    // The angle between the way to the receiver and the nearest direction that the light faces,
    // from anywhere in the sphere: cos(max(0, axis - spread - sphere)).
    Float8 cos_axis = -(axis_x_ * dx + axis_y_ * dy + axis_z_ * dz) * scale;
    cos_axis = both_sides_ > zero ? magnitude(cos_axis) : cos_axis;
    const Float8 sin_axis = root(larger(one - cos_axis * cos_axis, zero));
    const Float8 c = cos_axis * cos_spread_ + sin_axis * sin_spread_;
    const Float8 s = sin_axis * cos_spread_ - cos_axis * sin_spread_;
    const Float8 cos_left = c * cos_sphere + s * sin_sphere;
    const auto faces = (cos_axis >= cos_spread_) | (c >= cos_sphere);
    Float8 importance = strength_ / square;
    importance *= faces ? one : (cos_left > cos_reach_ ? cos_left : zero);

    // The receiver's own cosine, at its largest: cos(max(0, normal - sphere)).
    if (at.normal == Vec3f{}) {
        return importance;
    }
    Float8 cos_normal = (at.normal.x * dx + at.normal.y * dy + at.normal.z * dz) * scale;
    cos_normal = at.through ? magnitude(cos_normal) : cos_normal;
    const Float8 sin_normal = root(larger(one - cos_normal * cos_normal, zero));
    const Float8 cosine = cos_normal * cos_sphere + sin_normal * sin_sphere;
    return importance * (cos_normal >= cos_sphere ? one : larger(cosine, zero));
}

}  // namespace relume::render
