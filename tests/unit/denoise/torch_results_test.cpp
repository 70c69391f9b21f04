// Filters by networks: the same as what PyTorch makes of the same numbers (torch_results.py).
#include <gtest/gtest.h>

#include <cmath>

#include "server/denoise/kpcn.h"
#include "server/denoise/net_printed.h"
#include "tests/unit/denoise/random_stack.h"
#include "tests/unit/denoise/torch_results.h"

namespace relume::denoise {
namespace {

Frame DrawFrame() {
    Frame frame;
    frame.width = 21;
    frame.height = 19;
    Numbers numbers(7);
    const auto draw = [&](double scale, double shift = 0) {
        Plane plane(frame.pixel_count());
        for (float& value : plane) {
            value = static_cast<float>(scale * numbers.Draw() + shift);
        }
        return plane;
    };
    for (Plane& plane : frame.color) {
        plane = draw(2);
    }
    for (int c = 0; c < 3; ++c) {
        frame.feature[kAlbedoR + c] = draw(1);
    }
    for (int c = 0; c < 3; ++c) {
        frame.feature[kNormalX + c] = draw(2, -1);
    }
    frame.feature[kDepth] = draw(1);
    frame.feature[kDepth][0] = 1;  // the largest
    for (std::size_t i = 0; i < frame.pixel_count(); ++i) {
        for (int c = 0; c < 3; ++c) {
            if (i % 7 == 3) {
                frame.feature[kNormalX + c][i] = 0;
            }
            if (i % 5 == 2) {
                frame.feature[kAlbedoR + c][i] *= 0.005f;
            }
        }
    }
    frame.variance[0] = frame.variance[1] = frame.variance[2] = draw(0.1);
    const Plane albedo = draw(0.01), normal = draw(0.01), depth = draw(0.001), count = draw(8);
    for (std::size_t i = 0; i < frame.pixel_count(); ++i) {
        const float n = 1 + std::floor(count[i]);
        frame.count.push_back(n);
        for (int c = 0; c < 3; ++c) {
            frame.feature_variance[kAlbedoR + c].push_back(albedo[i] * n);
            frame.feature_variance[kNormalX + c].push_back(normal[i] * n);
        }
        frame.feature_variance[kDepth].push_back(depth[i] * n);
    }
    frame.flagged.assign(frame.pixel_count(), 0);
    return frame;
}

template <std::size_t kCount>
void ExpectResult(const Denoiser& denoiser, const float (&expected)[kCount]) {
    const Frame frame = DrawFrame();
    const Result result = denoiser.Reconstruct(frame, CancelToken{});
    constexpr std::size_t kEvery = 17;
    std::size_t k = 0;
    for (const Plane& plane : result.color) {
        for (std::size_t i = 0; i < plane.size(); i += kEvery, ++k) {
            ASSERT_LT(k, kCount);
            EXPECT_NEAR(plane[i], expected[k], 1e-4 * std::abs(expected[k])) << k;
        }
    }
    EXPECT_EQ(k, kCount);
}

TEST(TorchResults, Kpcn) {
    ExpectResult(*MakeKpcn("lite", RandomStack({34, 6, 6, 25}, 5, 11), "drawn"), kKpcnResult);
}

TEST(TorchResults, PrintedNet) {
    ExpectResult(*MakePrintedNet(RandomStack({16, 6, 6, 5}, 3, 11), "drawn"), kPrintedNetResult);
}

}  // namespace
}  // namespace relume::denoise
