#include "worker/render/light/environment_light.h"

#include <cmath>

#include "worker/render/sampler/warp.h"

namespace relume::render {

EnvironmentLight::EnvironmentLight(const Scene& scene, const Environment& environment)
    : color_(environment.color), to_world_(environment.to_world) {
    turned_ = !(to_world_ == Transform());
    from_world_ = to_world_.Inverse();
    if (environment.image < 0) {
        mean_ = Average(color_);
        return;
    }
    map_ = SphereMap(scene, environment.image, color_);
    mean_ = map_.mean();
    if (mean_ > 0) {
        table_ = TexelTable(map_);
        // Density in the map is weight / sum a texel.
        pdf_scale_ = static_cast<float>(1 / (map_.sum() * map_.solid_angle_scale()));
    }
}

EnvironmentLight::EnvironmentLight(const Scene& scene) {
    if (scene.environment != nullptr) {
        *this = EnvironmentLight(scene, *scene.environment);
    }
}

EnvironmentLight::Place EnvironmentLight::Find(Vec3f direction) const {
    Place place{direction, {}};
    if (!map_.empty()) {
        place.in_map = map_.Find(turned_ ? Normalize(from_world_.Vector(direction)) : direction);
        map_.Prefetch(place.in_map.x, place.in_map.y);
    }
    return place;
}

EnvironmentLight::Place EnvironmentLight::Draw(Vec2f u) const {
    if (map_.empty()) {
        return {SampleSphere(u), {}};
    }
    // A texel, then a place under its tent; the map is periodic in x and mirrored at the poles.
    const TexelTable::Texel texel = table_.Sample(&u);
    const float w = static_cast<float>(map_.width()), h = static_cast<float>(map_.height());
    float x = static_cast<float>(texel.x) + 0.5f + SampleTent(u.x);
    float y = static_cast<float>(texel.y) + 0.5f + SampleTent(u.y);
    x = x < 0 ? x + w : x >= w ? x - w : x;
    y = y < 0 ? -y : y > h ? 2 * h - y : y;
    map_.Prefetch(x, y);
    const SinCos theta = SinCosTurn(0.5f * y / h), phi = SinCosTurn(x / w);
    // u = x / w is half a turn ahead of the azimuth.
    const Vec3f local{-theta.sin * phi.sin, theta.cos, theta.sin * phi.cos};
    return {turned_ ? Normalize(to_world_.Vector(local)) : local, {x, y, theta.sin}};
}

Rgb EnvironmentLight::RadianceAt(const Place& place, float* pdf) const {
    if (map_.empty()) {
        if (pdf != nullptr) {
            *pdf = 1 / (4 * kPi);
        }
        return color_;
    }
    const Rgba c = map_.Interpolate(place.in_map.x, place.in_map.y);
    if (pdf != nullptr) {
        *pdf = place.in_map.sine > 0 ? c.a * pdf_scale_ / place.in_map.sine : 0;
    }
    return {c.r, c.g, c.b};
}

bool EnvironmentLight::SampleAt(const Place& drawn, LightSample* sample) const {
    sample->delta = false;
    sample->distance = std::numeric_limits<float>::infinity();
    sample->wi = drawn.direction;
    sample->radiance = RadianceAt(drawn, &sample->pdf);
    return sample->pdf > 0;
}

}  // namespace relume::render
