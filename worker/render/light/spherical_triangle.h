#pragma once

#include <algorithm>
#include <cmath>

#include "worker/render/sampler/elementary.h"
#include "worker/render/sampler/warp.h"

namespace relume::render {

// A triangle as it is seen from a point: drawn from uniformly by solid angle (Arvo 1995,
// "Stratified Sampling of Spherical Triangles"; the cut is found by its half tangent, which needs
// neither angles nor their inverses).
class SphericalTriangle {
  public:
    SphericalTriangle() = default;  // nothing
    // Unit vectors to the corners.
    SphericalTriangle(Vec3f a, Vec3f b, Vec3f c) : a_(a), b_(b), c_(c) {
        // Van Oosterom and Strackee 1983: the tangent of half the solid angle.
        determinant_ = std::abs(Dot(a, Cross(b, c)));
        const float ab = Dot(a, b), ac = Dot(a, c);
        half_ = Atan2(determinant_, 1 + ab + ac + Dot(b, c));
    }

    // Steradians, 0 to 2 pi.
    float solid_angle() const { return 2 * half_; }

    // A unit vector; solid_angle() is well above 0.
    Vec3f Sample(Vec2f u) const {
        // The corner c moves along its edge to a until the triangle has u.x of its solid angle E.
        // With A the angle at a: tan(E/2) (1 + k t cos A) = k t sin A, k and t the half tangents
        // of the arcs from a to b and to the new corner.
        const SinCos e = SinCosTurn(u.x * half_ * (0.5f * kInvPi));
        const Vec3f n_ab = Cross(a_, b_), n_ac = Cross(a_, c_);
        // Both times the lengths of the two normals.
        const float cos_a = Dot(n_ab, n_ac), sin_a = determinant_;
        const float length_ab = Length(n_ab), length_ac = Length(n_ac);
        const float k = length_ab / std::max(1 + Dot(a_, b_), 1e-20f);
        const float lengths = length_ab * length_ac;
        const float den = k * (sin_a * e.cos - cos_a * e.sin);
        const float num = e.sin * lengths;
        // cos and sin of the arc from its half tangent num / den.
        const float sum2 = num * num + den * den;
        const float scale = sum2 > 0 ? 1 / sum2 : 0;
        const float cos_arc = sum2 > 0 ? (den * den - num * num) * scale : 1;
        const float sin_arc = 2 * num * std::abs(den) * scale;
        const Vec3f toward_c = (c_ - a_ * Dot(a_, c_)) * (1 / std::max(length_ac, 1e-20f));
        const Vec3f corner = a_ * cos_arc + toward_c * sin_arc;
        // Along the arc from b to the new corner, uniform in the cosine from b.
        const float drop = u.y * 0.5f * Length2(corner - b_);  // 1 - cos
        const float sin_b = std::sqrt(std::max(0.0f, drop * (2 - drop)));
        const Vec3f across = corner - b_ * Dot(corner, b_);
        const float length = Length(across);
        return Normalize(b_ * (1 - drop) + across * (length > 0 ? sin_b / length : 0));
    }

  private:
    Vec3f a_, b_, c_;
    float determinant_ = 0, half_ = 0;
};

// A triangle, or two that share an edge, as they are seen from a point.
class SphericalQuad {
  public:
    // Unit vectors to the corners of a triangle, or of a b c and d c b.
    SphericalQuad(Vec3f a, Vec3f b, Vec3f c) : first_(a, b, c) {}
    SphericalQuad(Vec3f a, Vec3f b, Vec3f c, Vec3f d) : first_(a, b, c), second_(d, c, b) {}

    float solid_angle() const { return first_.solid_angle() + second_.solid_angle(); }

    // Uniform over both.
    Vec3f Sample(Vec2f u) const {
        const float at = u.x * solid_angle(), left = at - first_.solid_angle();
        if (left < 0 || second_.solid_angle() == 0) {
            return first_.Sample({std::min(at / first_.solid_angle(), 1.0f), u.y});
        }
        return second_.Sample({std::min(left / second_.solid_angle(), 1.0f), u.y});
    }

  private:
    SphericalTriangle first_, second_;
};

}  // namespace relume::render
