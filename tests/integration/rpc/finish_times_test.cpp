#include "server/rpc/finish_times.h"

#include <gtest/gtest.h>

namespace relume::server {
namespace {

TEST(FinishTimes, AreInProportionToPixelsByFilter) {
    FinishTimes times;
    EXPECT_FALSE(times.Predict("none", 100));
    times.Add("none", 100, 2);
    EXPECT_DOUBLE_EQ(*times.Predict("none", 50), 1);
    EXPECT_FALSE(times.Predict("bilateral", 100));
    times.Add("none", 100, 4);  // the newest counts half
    EXPECT_DOUBLE_EQ(*times.Predict("none", 100), 3);
    times.Add("none", 0, 4);
    EXPECT_DOUBLE_EQ(*times.Predict("none", 100), 3);
}

}  // namespace
}  // namespace relume::server
