#include "worker/render/sampler/elementary.h"

#include <gtest/gtest.h>

#include <cmath>

namespace relume::render {
namespace {

TEST(Elementary, Atan2IsAccurateInAllOctants) {
    for (int i = 0; i < 20000; ++i) {
        const double angle = -M_PI + 2 * M_PI * i / 20000;
        for (const double radius : {1e-12, 1.0, 3e9}) {
            const float y = static_cast<float>(radius * std::sin(angle));
            const float x = static_cast<float>(radius * std::cos(angle));
            const double exact = std::atan2(static_cast<double>(y), static_cast<double>(x));
            EXPECT_NEAR(Atan2(y, x), exact, 3e-7 * std::abs(exact)) << y << " " << x;
        }
    }
    EXPECT_EQ(Atan2(0, 0), 0);
    EXPECT_EQ(Atan2(0, 2), 0);
    EXPECT_FLOAT_EQ(Atan2(0, -2), 3.14159265f);
    EXPECT_FLOAT_EQ(Atan2(-2, 0), -1.57079633f);
}

}  // namespace
}  // namespace relume::render
