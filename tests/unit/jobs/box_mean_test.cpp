// Means over windows: thin images have longer ones.
#include "server/jobs/box_mean.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <vector>

namespace relume::jobs {
namespace {

// Pixels that one bright pixel in the middle reaches.
long Reach(int width, int height) {
    std::vector<float> plane(static_cast<std::size_t>(width) * static_cast<std::size_t>(height));
    plane[static_cast<std::size_t>(height / 2) * static_cast<std::size_t>(width) +
          static_cast<std::size_t>(width / 2)] = 1e30f;
    const std::vector<float> mean = BoxMean(plane, width, height);
    return std::ranges::count_if(mean, [](float v) { return v != 0; });
}

TEST(BoxMean, HasAsManyPixelsInThinImages) {
    EXPECT_EQ(Reach(101, 101), 441);
    EXPECT_EQ(Reach(2001, 1), 441);
    EXPECT_EQ(Reach(1, 2001), 441);
    EXPECT_NEAR(static_cast<double>(Reach(2001, 7)), 441, 7);
}

TEST(BoxMean, KeepsConstants) {
    for (const auto& [width, height] : {std::pair{1, 1}, {50, 30}, {900, 1}, {3, 700}, {30, 20}}) {
        const std::vector<float> plane(
            static_cast<std::size_t>(width) * static_cast<std::size_t>(height), 0.3f);
        for (const float v : BoxMean(plane, width, height)) {
            ASSERT_FLOAT_EQ(v, 0.3f) << width << "x" << height;
        }
    }
}

}  // namespace
}  // namespace relume::jobs
