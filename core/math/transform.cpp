#include "core/math/transform.h"

#include "core/base/error.h"

namespace relume {

Transform Transform::Translate(Vec3f t) {
    return Transform({1, 0, 0, t.x, 0, 1, 0, t.y, 0, 0, 1, t.z});
}

Transform Transform::Scale(Vec3f s) {
    return Transform({s.x, 0, 0, 0, 0, s.y, 0, 0, 0, 0, s.z, 0});
}

Transform Transform::Rotate(float x, float y, float z, float w) {
    return Transform({1 - 2 * (y * y + z * z), 2 * (x * y - z * w), 2 * (x * z + y * w), 0,
                      2 * (x * y + z * w), 1 - 2 * (x * x + z * z), 2 * (y * z - x * w), 0,
                      2 * (x * z - y * w), 2 * (y * z + x * w), 1 - 2 * (x * x + y * y), 0});
}

Transform Transform::FromColumns(const std::array<float, 16>& c) {
    if (c[3] != 0 || c[7] != 0 || c[11] != 0 || c[15] != 1) {
        ThrowInvalidArgument("a 4x4 matrix is not affine (its last row must be 0 0 0 1)");
    }
    return Transform({c[0], c[4], c[8], c[12], c[1], c[5], c[9], c[13], c[2], c[6], c[10], c[14]});
}

Transform Transform::LookAt(Vec3f eye, Vec3f target, Vec3f up) {
    const Vec3f z = Normalize(eye - target);
    const Vec3f x = Normalize(Cross(up, z));
    const Vec3f y = Cross(z, x);
    return Transform({x.x, y.x, z.x, eye.x, x.y, y.y, z.y, eye.y, x.z, y.z, z.z, eye.z});
}

Vec3f Transform::Point(Vec3f p) const { return Vector(p) + Vec3f{m_[3], m_[7], m_[11]}; }

Vec3f Transform::Vector(Vec3f v) const {
    return {m_[0] * v.x + m_[1] * v.y + m_[2] * v.z, m_[4] * v.x + m_[5] * v.y + m_[6] * v.z,
            m_[8] * v.x + m_[9] * v.y + m_[10] * v.z};
}

Vec3f Transform::Normal(Vec3f n) const {
    // Cofactors are the transposed inverse times the determinant: keep the determinant's sign.
    const Vec3f r0{m_[0], m_[1], m_[2]}, r1{m_[4], m_[5], m_[6]}, r2{m_[8], m_[9], m_[10]};
    const Vec3f c0 = Cross(r1, r2), c1 = Cross(r2, r0), c2 = Cross(r0, r1);
    const Vec3f v{Dot(c0, n), Dot(c1, n), Dot(c2, n)};
    return Dot(r0, c0) < 0 ? -v : v;
}

Transform Transform::operator*(const Transform& right) const {
    std::array<float, 12> out{};
    for (int r = 0; r < 3; ++r) {
        for (int c = 0; c < 4; ++c) {
            float sum = c == 3 ? m_[r * 4 + 3] : 0.0f;
            for (int k = 0; k < 3; ++k) {
                sum += m_[r * 4 + k] * right.m_[k * 4 + c];
            }
            out[r * 4 + c] = sum;
        }
    }
    return Transform(out);
}

float Transform::Determinant() const {
    return Dot({m_[0], m_[1], m_[2]}, Cross({m_[4], m_[5], m_[6]}, {m_[8], m_[9], m_[10]}));
}

Transform Transform::Inverse() const {
    const float det = Determinant();
    if (det == 0 || !std::isfinite(det)) {
        ThrowInvalidArgument("a transform can't be inverted (a scale of 0?)");
    }
    const Vec3f r0{m_[0], m_[1], m_[2]}, r1{m_[4], m_[5], m_[6]}, r2{m_[8], m_[9], m_[10]};
    const Vec3f c0 = Cross(r1, r2) / det, c1 = Cross(r2, r0) / det, c2 = Cross(r0, r1) / det;
    const Transform linear({c0.x, c1.x, c2.x, 0, c0.y, c1.y, c2.y, 0, c0.z, c1.z, c2.z, 0});
    const Vec3f t = linear.Vector({m_[3], m_[7], m_[11]});
    std::array<float, 12> out = linear.rows();
    out[3] = -t.x;
    out[7] = -t.y;
    out[11] = -t.z;
    return Transform(out);
}

bool Transform::IsFinite() const {
    for (const float v : m_) {
        if (!std::isfinite(v)) {
            return false;
        }
    }
    return true;
}

}  // namespace relume
