#include "worker/render/light/punctual.h"

#include <algorithm>
#include <cmath>

namespace relume::render {

bool PunctualLight::Illuminate(Vec3f p, LightSample* sample) const {
    sample->delta = true;
    if (kind == Kind::kDirectional) {
        sample->wi = -direction;
        sample->distance = std::numeric_limits<float>::infinity();
        sample->radiance = strength;
        return true;
    }
    const Vec3f to_light = position - p;
    const float distance2 = Length2(to_light);
    if (!(distance2 > 0)) {
        return false;
    }
    sample->distance = std::sqrt(distance2);
    sample->wi = to_light * (1 / sample->distance);
    float falloff = 1 / distance2;
    if (kind == Kind::kSpot) {
        const float cone =
            std::clamp(cone_scale * -Dot(direction, sample->wi) + cone_offset, 0.0f, 1.0f);
        falloff *= cone * cone;
    }
    sample->radiance = strength * falloff;
    return falloff > 0;
}

double PunctualLight::Power(float scene_radius) const {
    switch (kind) {
        case Kind::kPoint:
            return 4 * kPi * Average(strength);
        case Kind::kSpot:
            return cone_solid_angle * Average(strength);
        case Kind::kDirectional:
            break;
    }
    return kPi * scene_radius * scene_radius * Average(strength);
}

}  // namespace relume::render
