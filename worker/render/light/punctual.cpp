#include "worker/render/light/punctual.h"

#include <algorithm>
#include <cmath>

namespace relume::render {

float PunctualLight::Cone(float cosine) const {
    const float t = std::clamp(cone_scale * cosine + cone_offset, 0.0f, 1.0f);
    switch (falloff) {
        case Falloff::kSquare:
            break;
        case Falloff::kSmoothstep:
            return t * t * (3 - 2 * t);
        case Falloff::kQuartic:
            return t * t * t * t;
    }
    return t * t;
}

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
    float arriving = 1 / distance2;
    if (kind == Kind::kSpot) {
        arriving *= Cone(-Dot(direction, sample->wi));
    }
    sample->radiance = strength * arriving;
    if (kind == Kind::kGoniometric) {
        const SphereMap::Place place = map->Find(Normalize(from_world.Vector(-sample->wi)));
        const Rgba share = map->Interpolate(place.x, place.y);
        sample->radiance *= Rgb{share.r, share.g, share.b};
    }
    return MaxComponent(sample->radiance) > 0;
}

LightExtent PunctualLight::Extent() const {
    LightExtent extent;
    extent.box.Add(position);
    extent.strength = Average(strength);
    extent.axis = direction;
    extent.spread = kPi;
    extent.reach = kPi / 2;
    if (kind == Kind::kSpot) {
        extent.spread = std::max(cone_inner, cone_outer - kPi / 2);
        extent.reach = cone_outer - extent.spread;
    } else if (kind == Kind::kGoniometric) {
        extent.strength *= static_cast<float>(map->mean());
    }
    return extent;
}

double PunctualLight::Power(float scene_radius) const {
    switch (kind) {
        case Kind::kPoint:
            return 4 * kPi * Average(strength);
        case Kind::kSpot:
            return cone_solid_angle * Average(strength);
        case Kind::kGoniometric:
            return 4 * kPi * Average(strength) * map->mean();
        case Kind::kDirectional:
            break;
    }
    return kPi * scene_radius * scene_radius * Average(strength);
}

}  // namespace relume::render
