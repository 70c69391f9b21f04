#include "worker/render/accel/surface.h"

#include <algorithm>
#include <cmath>
#include <optional>

namespace relume::render {
namespace {

// Rounding of a hit point, in units of the largest number it was computed from: the point, the way
// to it, the edges of the triangle. Embree's intersection and origin + t direction were off by at
// most 5 units of 2^-24 over triangles of all sizes, shapes and places, and no ray met its own
// triangle again from 8 units on. Four times that, for instances and slivers.
constexpr float kRounding = 0x1p-19f;

// Least cosine between the shading normal and the view, unless the surface itself is seen at less.
constexpr float kLeastCosine = 0.02f, kSmallestCosine = 1e-4f;

// Tangent (towards growing u) at the hit, world space.
Vec3f TangentAt(const Object& object, const Hit& hit) {
    return object.TransformTangent(object.Tangent(hit.triangle, hit.u, hit.v));
}

Vec3f NormalTexel(const TextureSet& textures, TextureId id, Vec2f uv) {
    const Rgba t = textures.Lookup(id, uv);
    return {t.r, t.g, t.b};
}

// glTF 2.0, 3.9.3; `t` is what the map holds, in [0, 1].
Vec3f MappedNormal(const Object& object, const Hit& hit, Vec3f normal, Vec3f t, float scale) {
    const Frame frame = Frame::FromZX(normal, TangentAt(object, hit));
    const int nearest = hit.u + hit.v < 0.5f ? 0 : hit.u > hit.v ? 1 : 2;
    const std::uint16_t signs = object.triangles[hit.triangle].tangent_signs;
    const bool negative = (((signs >> nearest) & 1) != 0) != object.mirrored;
    const float x = (2 * t.x - 1) * scale, y = (2 * t.y - 1) * scale;
    const Vec3f n =
        frame.x * x + frame.y * (negative ? -y : y) + frame.z * std::max(2 * t.z - 1, 1e-3f);
    return Normalize(n);
}

// The normal of the surface displaced along its normal (Blinn 1978): the height's gradient, by
// differences over one texel, is taken from it.
Vec3f BumpedNormal(const Object& object, const Hit& hit, Vec3f normal, Vec2f uv,
                   const CompiledMaterial& material, const TextureSet& textures) {
    const Vec2f step = textures.TexelSize(material.bump_texture);
    const auto height = [&](float du, float dv) {
        return textures.Lookup(material.bump_texture, {uv.x + du, uv.y + dv}).r;
    };
    const float along_u =
        (height(0.5f * step.x, 0) - height(-0.5f * step.x, 0)) / step.x * material.bump_scale;
    const float along_v =
        (height(0, 0.5f * step.y) - height(0, -0.5f * step.y)) / step.y * material.bump_scale;
    const UvGradients& g = object.gradients[hit.triangle];
    const Vec3f gradient = object.TransformGradient(g.u * along_u + g.v * along_v);
    const Vec3f n = normal - (gradient - normal * Dot(gradient, normal));
    return IsFinite(n) ? Normalize(n) : normal;
}

}  // namespace

Vec2f HitUv(const Object& object, const Hit& hit) {
    return object.triangles != nullptr ? object.triangles[hit.triangle].Uv(hit.u, hit.v) : Vec2f{};
}

Surface MakeSurface(const Object& at_first, const Hit& hit, Vec3f origin, Vec3f direction, Vec2f uv,
                    const CompiledMaterial& material, const TextureSet& textures,
                    const SurfaceTexels* texels) {
    std::optional<Object> moved;
    const Object& object = at_first.At(hit.time, &moved);
    Surface s;
    s.uv = uv;
    s.point = origin + direction * hit.t;
    float coordinate = std::max(
        {std::abs(s.point.x), std::abs(s.point.y), std::abs(s.point.z), hit.t, object.extent});
    if (object.triangles != nullptr) {
        coordinate = std::max(coordinate, object.triangles[hit.triangle].Size() * object.scale);
    }
    s.rounding = coordinate * kRounding;

    const Vec3f front = hit.normal;
    s.at.front = Dot(front, direction) < 0;
    s.at.geometric = s.at.front ? front : -front;
    Vec3f normal = front;
    if (object.has_normals) {
        const Vec3f n = object.TransformNormal(object.Normal(hit.triangle, hit.u, hit.v));
        const float length2 = Length2(n);
        if (length2 > 0) {
            normal = n * (1 / std::sqrt(length2));
        }
        if (Dot(normal, front) < 0) {  // normals that contradict the winding: the winding is right
            normal = -normal;
        }
    }
    const bool mapped = object.triangles != nullptr;
    if (material.model == Model::kLayered) {
        Vec3f coat = normal;
        if (mapped && material.clearcoat_normal_texture >= 0) {
            coat = MappedNormal(object, hit, normal,
                                NormalTexel(textures, material.clearcoat_normal_texture, uv),
                                material.clearcoat_normal_scale);
        }
        s.at.coat = s.at.front ? coat : -coat;
    }
    if (mapped && material.normal_texture >= 0) {
        normal = MappedNormal(
            object, hit, normal,
            texels != nullptr ? texels->normal : NormalTexel(textures, material.normal_texture, uv),
            material.normal_scale);
    }
    if (object.gradients != nullptr) {
        normal = BumpedNormal(object, hit, normal, uv, material, textures);
    }
    if (!s.at.front) {
        normal = -normal;
    }
    // A normal that looks away from the viewer (interpolated, or from a map) is bent back to the
    // rim.
    const float cos_o = -Dot(normal, direction);
    const float least = std::clamp(-Dot(s.at.geometric, direction), kSmallestCosine, kLeastCosine);
    if (cos_o < least) {
        normal = Normalize(normal - direction * (least - cos_o));
    }
    s.at.frame = mapped && material.anisotropic ? Frame::FromZX(normal, TangentAt(object, hit))
                                                : Frame::FromZ(normal);
    return s;
}

}  // namespace relume::render
