#include "core/scene/pbrt_motion.h"

#include <algorithm>
#include <array>
#include <cmath>

#include "core/scene/pbrt_state.h"

namespace relume::pbrt {
namespace {

using Quaternion = std::array<double, 4>;  // x y z w

struct Parts {
    Vec3f translation;
    Quaternion rotation;
    Transform scale;  // and skew: what is left
};

Transform Linear(const Transform& transform) {
    std::array<float, 12> rows = transform.rows();
    rows[3] = rows[7] = rows[11] = 0;
    return Transform(rows);
}

Transform Transposed(const Transform& t) {
    const auto& m = t.rows();
    return Transform({m[0], m[4], m[8], 0, m[1], m[5], m[9], 0, m[2], m[6], m[10], 0});
}

Transform Mean(const Transform& a, const Transform& b, float weight) {
    std::array<float, 12> rows{};
    for (std::size_t i = 0; i < rows.size(); ++i) {
        rows[i] = (1 - weight) * a.rows()[i] + weight * b.rows()[i];
    }
    return Transform(rows);
}

Quaternion ToQuaternion(const Transform& rotation) {
    const auto& m = rotation.rows();
    const auto at = [&](std::size_t r, std::size_t c) { return static_cast<double>(m[4 * r + c]); };
    Quaternion q{};
    const double trace = at(0, 0) + at(1, 1) + at(2, 2);
    if (trace > 0) {
        const double s = 2 * std::sqrt(trace + 1);
        q = {(at(2, 1) - at(1, 2)) / s, (at(0, 2) - at(2, 0)) / s, (at(1, 0) - at(0, 1)) / s,
             s / 4};
    } else {  // by its largest component
        std::size_t i = at(1, 1) > at(0, 0) ? 1 : 0;
        i = at(2, 2) > at(i, i) ? 2 : i;
        const std::size_t j = (i + 1) % 3, k = (i + 2) % 3;
        const double s = 2 * std::sqrt(std::max(1 + at(i, i) - at(j, j) - at(k, k), 1e-12));
        q[i] = s / 4;
        q[j] = (at(j, i) + at(i, j)) / s;
        q[k] = (at(k, i) + at(i, k)) / s;
        q[3] = (at(k, j) - at(j, k)) / s;
    }
    double length = 0;
    for (const double v : q) {
        length += v * v;
    }
    for (double& v : q) {
        v /= std::sqrt(length);
    }
    return q;
}

Transform ToRotation(const Quaternion& q) {
    return Transform::Rotate(static_cast<float>(q[0]), static_cast<float>(q[1]),
                             static_cast<float>(q[2]), static_cast<float>(q[3]));
}

Quaternion Slerp(const Quaternion& a, Quaternion b, double u) {
    double dot = 0;
    for (std::size_t i = 0; i < 4; ++i) {
        dot += a[i] * b[i];
    }
    if (dot < 0) {  // the shorter way
        dot = -dot;
        for (double& v : b) {
            v = -v;
        }
    }
    const double angle = std::acos(std::min(dot, 1.0)), sine = std::sin(angle);
    const double wa = sine > 1e-6 ? std::sin(angle * (1 - u)) / sine : 1 - u;
    const double wb = sine > 1e-6 ? std::sin(angle * u) / sine : u;
    Quaternion q{};
    for (std::size_t i = 0; i < 4; ++i) {
        q[i] = wa * a[i] + wb * b[i];
    }
    return q;
}

// The rotation nearest to the linear part, by repeated means with its transposed inverse; a
// mirroring stays in the scale.
Parts Decompose(const Transform& transform, const Place& place) {
    const Transform linear = Linear(transform);
    const bool mirrored = linear.Determinant() < 0;
    const Transform flip = Transform::Scale({-1, -1, -1});
    Transform rotation = mirrored ? linear * flip : linear;
    for (int i = 0; i < 100; ++i) {
        const Transform next =
            Mean(rotation, Transposed(Inverse(rotation, place, "moving transformation")), 0.5f);
        float change = 0;
        for (std::size_t k = 0; k < 12; ++k) {
            change = std::max(change, std::abs(next.rows()[k] - rotation.rows()[k]));
        }
        rotation = next;
        if (change < 1e-6f) {
            break;
        }
    }
    Parts parts;
    parts.translation = transform.Point({0, 0, 0});
    parts.rotation = ToQuaternion(rotation);
    parts.scale = Transposed(ToRotation(parts.rotation)) * linear;
    return parts;
}

}  // namespace

SampledTransform SampleBetween(const Ctm& ctm, const std::array<float, 2>& ends,
                               const std::vector<double>& times, const Place& place) {
    if (!ctm.moves()) {
        return {ctm.at[0]};
    }
    const Parts a = Decompose(ctm.at[0], place), b = Decompose(ctm.at[1], place);
    SampledTransform samples;
    for (const double time : times) {
        const double length = static_cast<double>(ends[1]) - static_cast<double>(ends[0]);
        const double u = std::clamp((time - static_cast<double>(ends[0])) / length, 0.0, 1.0);
        if (u == 0 || u == 1) {  // to the bit
            samples.push_back(ctm.at[u == 0 ? 0 : 1]);
            continue;
        }
        const float weight = static_cast<float>(u);
        samples.push_back(
            Transform::Translate(a.translation + (b.translation - a.translation) * weight) *
            ToRotation(Slerp(a.rotation, b.rotation, u)) * Mean(a.scale, b.scale, weight));
    }
    if (KeysNeeded(samples) == 1) {
        samples.resize(1);
    }
    return samples;
}

}  // namespace relume::pbrt
