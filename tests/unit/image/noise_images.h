#pragma once

#include <cstdint>
#include <limits>
#include <utility>

#include "core/image/image.h"

namespace relume {

// Numbers in [0,1) with 24 bits, the same on every machine (Numerical Recipes' constants).
class Lcg {
  public:
    explicit Lcg(std::uint32_t seed) : state_(seed) {}
    double Next() {
        state_ = state_ * 1664525u + 1013904223u;
        return (state_ >> 8) / 16777216.0;
    }

  private:
    std::uint32_t state_;
};

// A textured HDR image of values up to about 9 and a noisy copy of it with a few fireflies; with
// `bad`, some pixels of either hold a NaN or an infinity.
inline std::pair<Image, Image> NoisePair(int width, int height, std::uint32_t seed, bool bad) {
    Image reference(width, height, {"R", "G", "B"}), test(width, height, {"R", "G", "B"});
    Lcg random(seed);
    for (std::size_t i = 0; i < reference.pixel_count(); ++i) {
        const auto x = i % static_cast<std::size_t>(width), y = i / static_cast<std::size_t>(width);
        for (int c = 0; c < 3; ++c) {
            const double ramp = static_cast<double>((x * 7 + y * 3) % 32) / 32.0;
            const double u = random.Next(), v = random.Next(), w = random.Next();
            const double value = ramp * ramp + 8 * u * u * u * u;
            const double firefly = w > 0.999 ? 100 : 0;
            reference.Plane(c)[i] = static_cast<float>(value);
            test.Plane(c)[i] = static_cast<float>(value * (0.5 + v) + 0.02 * w + firefly);
        }
        if (bad && i % 97 == 5) {
            reference.Plane(1)[i] = std::numeric_limits<float>::quiet_NaN();
        }
        if (bad && i % 131 == 7) {
            test.Plane(2)[i] = std::numeric_limits<float>::infinity();
        }
    }
    return {std::move(reference), std::move(test)};
}

}  // namespace relume
