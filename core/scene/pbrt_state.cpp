#include "core/scene/pbrt_state.h"

#include <fmt/format.h>

#include <cmath>
#include <utility>

#include "core/base/error.h"

namespace relume::pbrt {
namespace {

constexpr std::size_t kMaxDepth = 4096;

const char* Name(StateStack::Block block) {
    switch (block) {
        case StateStack::Block::kAttribute:
            return "Attribute";
        case StateStack::Block::kTransform:
            return "Transform";
        case StateStack::Block::kObject:
            return "Object";
        case StateStack::Block::kImport:
            return "Import";
    }
    return "";
}

}  // namespace

void StateStack::Begin(Block block, const Place& place) {
    if (stack_.size() >= kMaxDepth) {
        Fail(place, fmt::format("blocks are nested more than {} deep; close some", kMaxDepth));
    }
    stack_.push_back({block, place, now_});
}

void StateStack::End(Block block, const Place& place) {
    if (stack_.empty()) {
        Fail(place, fmt::format("{0}End without {0}Begin; remove it", Name(block)));
    }
    Saved& saved = stack_.back();
    if (block == Block::kImport && saved.block != block) {
        Fail(saved.place, fmt::format("this {0}Begin is not closed in the file that is imported; "
                                      "add a {0}End",
                                      Name(saved.block)));
    }
    if (saved.block == Block::kImport && saved.block != block) {
        Fail(place, fmt::format("{0}End without {0}Begin in the file that is imported; remove it",
                                Name(block)));
    }
    if (saved.block != block) {
        Fail(place, fmt::format("{}End, but the open block is the {}Begin at {}; close that first",
                                Name(block), Name(saved.block), saved.place.Text()));
    }
    if (block == Block::kTransform) {
        now_.ctm = saved.state.ctm;
        now_.active[0] = saved.state.active[0];
        now_.active[1] = saved.state.active[1];
    } else {
        now_ = std::move(saved.state);
    }
    stack_.pop_back();
}

void StateStack::RequireClosed() const {
    if (!stack_.empty()) {
        Fail(stack_.back().place,
             fmt::format("this {0}Begin is not closed; add a {0}End", Name(stack_.back().block)));
    }
}

void StateStack::Concatenate(const Transform& transform) {
    for (int i = 0; i < 2; ++i) {
        if (now_.active[i]) {
            now_.ctm.at[i] = now_.ctm.at[i] * transform;
        }
    }
}

void StateStack::Replace(const Transform& transform) {
    for (int i = 0; i < 2; ++i) {
        if (now_.active[i]) {
            now_.ctm.at[i] = transform;
        }
    }
}

bool StateStack::UseCoordinates(const std::string& name) {
    const auto it = coordinates_.find(name);
    if (it == coordinates_.end()) {
        return false;
    }
    now_.ctm = it->second;
    return true;
}

Transform LookAt(const std::array<float, 9>& v, const Place& place) {
    const Vec3f eye{v[0], v[1], v[2]}, target{v[3], v[4], v[5]}, up{v[6], v[7], v[8]};
    const Vec3f z = Normalize(target - eye);
    const Vec3f x = Normalize(Cross(Normalize(up), z));
    const Vec3f y = Cross(z, x);
    const Transform to_world({x.x, y.x, z.x, eye.x, x.y, y.y, z.y, eye.y, x.z, y.z, z.z, eye.z});
    if (!to_world.IsFinite()) {
        Fail(place,
             "LookAt: the eye is at the target, or the up vector is 0 or along the view; "
             "correct it");
    }
    return Inverse(to_world, place, "LookAt");
}

Transform Rotate(float degrees, Vec3f axis, const Place& place) {
    const Vec3f unit = Normalize(axis);
    if (!IsFinite(unit)) {
        Fail(place, "Rotate: the axis has no length; correct it");
    }
    const float half = degrees * (kPi / 360), s = std::sin(half);
    return Transform::Rotate(unit.x * s, unit.y * s, unit.z * s, std::cos(half));
}

Transform FromMatrix(std::array<float, 16> m, const Place& place) {
    if (m[3] != 0 || m[7] != 0 || m[11] != 0 || m[15] == 0) {
        Fail(place,
             "the matrix is not affine (its 4th, 8th and 12th number must be 0, its 16th 1)");
    }
    const float w = m[15];
    for (float& number : m) {
        number /= w;
    }
    m[15] = 1;
    const Transform transform = Transform::FromColumns(m);
    if (!transform.IsFinite()) {
        Fail(place, "the matrix is not finite; correct it");
    }
    return transform;
}

Transform Inverse(const Transform& transform, const Place& place, const char* what) {
    try {
        const Transform inverse = transform.Inverse();
        if (inverse.IsFinite()) {
            return inverse;
        }
    } catch (const Error&) {
    }
    Fail(place,
         fmt::format("{}: the transformation is singular (a scale of 0?); correct it", what));
}

}  // namespace relume::pbrt
