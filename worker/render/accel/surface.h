#pragma once

#include "worker/render/accel/accel.h"
#include "worker/render/bsdf/bsdf.h"

namespace relume::render {

// A hit point made ready for shading.
struct Surface {
    Vec3f point;
    Vec2f uv;
    ShadingFrame at;
    float rounding = 0;  // how far off the true surface `point` may be, with a margin

    // Where a ray that leaves towards `wi` begins: off the surface, on the side of wi, so that it
    // doesn't meet it again.
    Vec3f Leave(Vec3f wi) const {
        return point + at.geometric * (Dot(wi, at.geometric) > 0 ? rounding : -rounding);
    }
};

// The point's place is known before its normal: textures can be asked for in between.
Vec2f HitUv(const Object& object, const Hit& hit);

// `origin` and `direction` (unit length) are those of the ray; `texels` those of the material's
// pack, if it has one.
Surface MakeSurface(const Object& object, const Hit& hit, Vec3f origin, Vec3f direction, Vec2f uv,
                    const CompiledMaterial& material, const TextureSet& textures,
                    const SurfaceTexels* texels = nullptr);

}  // namespace relume::render
