#pragma once

#include <array>

#include "core/math/vec.h"

namespace relume {

// Affine map, row-major 3x4: p' = M p + t. Applied to column vectors.
class Transform {
  public:
    Transform() = default;
    explicit Transform(const std::array<float, 12>& rows) : m_(rows) {}

    static Transform Translate(Vec3f t);
    static Transform Scale(Vec3f s);
    // Unit quaternion (x, y, z, w), as glTF stores it.
    static Transform Rotate(float x, float y, float z, float w);
    // 4x4 in column-major order, as glTF and pbrt store it; the last row must be 0 0 0 1.
    static Transform FromColumns(const std::array<float, 16>& columns);
    // Camera at `eye` that looks to `target`: camera space looks along -z with +y up (glTF,
    // OpenGL).
    static Transform LookAt(Vec3f eye, Vec3f target, Vec3f up);

    Vec3f Point(Vec3f p) const;
    Vec3f Vector(Vec3f v) const;
    // Normals go by the transposed inverse; not normalised.
    Vec3f Normal(Vec3f n) const;

    Transform operator*(const Transform& right) const;
    // Of a singular map: throws kInvalidArgument.
    Transform Inverse() const;
    float Determinant() const;
    bool IsFinite() const;

    const std::array<float, 12>& rows() const { return m_; }
    friend bool operator==(const Transform&, const Transform&) = default;

  private:
    std::array<float, 12> m_{1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0};
};

}  // namespace relume
