// Convolutions: by the definition, and the same bits by every instruction set.
#include "server/denoise/convolve_kernels.h"

#include <gtest/gtest.h>

#include "server/denoise/planes.h"
#include "tests/unit/denoise/synthetic.h"

namespace relume::denoise {
namespace {

TEST(Convolve, FollowsTheDefinition) {
    constexpr int kWidth = 79, kHeight = 12;
    const std::vector<float> taps = {1, -2, 4, 0.5f, 3};
    const Plane in = MakeRandomFrame(kWidth, kHeight, 1).color[0];
    const Plane out = Convolve(in, kWidth, kHeight, taps);
    for (int y = 0; y < kHeight; ++y) {
        for (int x = 0; x < kWidth; ++x) {
            double sum = 0;
            for (int v = -2; v <= 2; ++v) {
                for (int u = -2; u <= 2; ++u) {
                    if (x + u >= 0 && x + u < kWidth && y + v >= 0 && y + v < kHeight) {
                        sum += static_cast<double>(taps[static_cast<std::size_t>(u + 2)]) *
                               taps[static_cast<std::size_t>(v + 2)] *
                               in[static_cast<std::size_t>((y + v) * kWidth + x + u)];
                    }
                }
            }
            ASSERT_NEAR(out[static_cast<std::size_t>(y * kWidth + x)], sum, 1e-4);
        }
    }
}

TEST(Convolve, SameBitsByEveryKernel) {
    const Plane in = MakeRandomFrame(300, 9, 2).color[0];
    const std::vector<float> taps = GaussianTaps(1.3f);
    const ConvolveList usable = UsableConvolves();
    for (const int width : {1, 3, 17, 63, 200}) {
        for (const std::ptrdiff_t step : {1, 300}) {
            const auto run = [&](ConvolveKernel kernel) {
                Plane out(static_cast<std::size_t>(width));
                kernel(in.data(), step, taps.data(), static_cast<int>(taps.size()), width,
                       out.data());
                return out;
            };
            for (int k = 1; k < usable.size; ++k) {
                EXPECT_TRUE(run(usable.list[k]) == run(usable.list[0])) << width << ", " << step;
            }
        }
    }
}

}  // namespace
}  // namespace relume::denoise
