#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <memory>
#include <set>
#include <utility>

#include "core/scene/pbrt_lights.h"

// Pictures of infinite and goniometric lights, as Scene has them.
namespace relume::pbrt {
namespace {

void MakeLinear(SceneImage* image) {
    image->floats.reserve(image->bytes.size());
    for (const std::uint8_t byte : image->bytes) {
        const float c = static_cast<float>(byte) / 255;
        image->floats.push_back(c <= 0.04045f ? c / 12.92f : std::pow((c + 0.055f) / 1.055f, 2.4f));
    }
    image->bytes = {};
}

// Texels beyond an edge of an equal-area map lie on the same edge, mirrored.
Rgb Texel(const SceneImage& image, int x, int y) {
    const int n = image.width;
    if (x < 0 || x >= n) {
        x = x < 0 ? -1 - x : 2 * n - 1 - x;
        y = n - 1 - y;
    }
    if (y < 0 || y >= n) {
        y = y < 0 ? -1 - y : 2 * n - 1 - y;
        x = n - 1 - x;
    }
    x = std::clamp(x, 0, n - 1);
    y = std::clamp(y, 0, n - 1);
    const auto channels = static_cast<std::size_t>(image.channels);
    const std::size_t at =
        (static_cast<std::size_t>(y) * static_cast<std::size_t>(n) + static_cast<std::size_t>(x)) *
        channels;
    return channels < 3 ? Rgb{1, 1, 1} * image.floats[at]
                        : Rgb{image.floats[at], image.floats[at + 1], image.floats[at + 2]};
}

Rgb Bilinear(const SceneImage& image, Vec2f uv) {
    const auto n = static_cast<float>(image.width);
    const float x = uv.x * n - 0.5f, y = uv.y * n - 0.5f;
    const float fx = std::floor(x), fy = std::floor(y);
    const int x0 = static_cast<int>(fx), y0 = static_cast<int>(fy);
    return Lerp(y - fy, Lerp(x - fx, Texel(image, x0, y0), Texel(image, x0 + 1, y0)),
                Lerp(x - fx, Texel(image, x0, y0 + 1), Texel(image, x0 + 1, y0 + 1)));
}

// pbrt's equal-area map in latitude (z up) and longitude, 2 x 2 samples a texel.
SceneImage ToLatitudeLongitude(const SceneImage& square) {
    SceneImage map;
    map.name = square.name;
    map.width = 2 * square.width;
    map.height = square.height;
    if (square.floats.empty()) {
        return map;
    }
    map.channels = 3;
    map.floats.reserve(static_cast<std::size_t>(map.width) * static_cast<std::size_t>(map.height) *
                       3);
    for (int y = 0; y < map.height; ++y) {
        for (int x = 0; x < map.width; ++x) {
            Rgb sum;
            for (int i = 0; i < 4; ++i) {
                const float phi = 2 * kPi *
                                  (static_cast<float>(x) + ((i & 1) != 0 ? 0.75f : 0.25f)) /
                                  static_cast<float>(map.width);
                const float theta = kPi * (static_cast<float>(y) + ((i & 2) != 0 ? 0.75f : 0.25f)) /
                                    static_cast<float>(map.height);
                sum += Bilinear(
                    square, EqualAreaSquare({std::sin(theta) * std::cos(phi),
                                             std::sin(theta) * std::sin(phi), std::cos(theta)}));
            }
            for (int c = 0; c < 3; ++c) {
                map.floats.push_back(0.25f * sum[c]);
            }
        }
    }
    return map;
}

}  // namespace

Vec2f EqualAreaSquare(Vec3f d) {
    const float x = std::abs(d.x), y = std::abs(d.y), z = std::abs(d.z);
    const float r = std::sqrt(std::max(0.0f, 1 - z));
    const float a = std::max(x, y), b = std::min(x, y);
    float angle = a == 0 ? 0 : std::atan(b / a) * (2 / kPi);  // 0 to 1/2
    angle = x < y ? 1 - angle : angle;
    float v = angle * r, u = r - v;
    if (d.z < 0) {
        std::swap(u, v);
        u = 1 - u;
        v = 1 - v;
    }
    return {(std::copysign(u, d.x) + 1) / 2, (std::copysign(v, d.y) + 1) / 2};
}

void FinishLights(const LightPlan& plan, Scene* scene, Notes* notes) {
    std::set<int> done;  // two lights may have one picture
    const auto convert = [&](int picture, bool equal_area) {
        SceneImage& image = scene->images[static_cast<std::size_t>(picture)];
        if (!done.insert(picture).second) {
            return;
        }
        MakeLinear(&image);
        if (equal_area && image.width == image.height) {
            image = ToLatitudeLongitude(image);
        } else if (equal_area) {
            notes->Add({}, fmt::format("{}: is not square, as pbrt-v4's equal-area maps are: it is "
                                       "taken as a latitude-longitude map",
                                       image.name));
        }
    };
    if (plan.environment.exists) {
        Environment environment = plan.environment.environment;
        environment.image = plan.environment.picture;
        if (environment.image >= 0) {
            convert(environment.image, plan.environment.equal_area);
        }
        scene->environment = std::make_shared<Environment>(environment);
    }
    for (const PicturedLight& light : plan.pictured) {
        convert(light.picture, light.equal_area);
        scene->lights[light.light].params.Set("image", static_cast<float>(light.picture));
    }
}

}  // namespace relume::pbrt
