// The weighted mean of filters.
#include "server/denoise/blend.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <vector>

#include "server/denoise/denoiser.h"
#include "tests/unit/denoise/synthetic.h"

namespace relume::denoise {
namespace {

using testing::Contains;
using testing::ElementsAre;
using testing::FloatNear;
using testing::Key;

std::vector<float> Drawn(std::vector<float> values) {
    DrawTogether(values);
    return values;
}

TEST(DrawTogether, NoneIsFarFromTheMedian) {
    EXPECT_THAT(Drawn({1, 1.2f, 0.9f}), ElementsAre(1, 1.2f, 0.9f));
    EXPECT_THAT(Drawn({1, 900, 0.9f}), ElementsAre(1, FloatNear(1.525f, 1e-6f), 0.9f));
    EXPECT_THAT(Drawn({-3, 0, 0}), ElementsAre(FloatNear(-0.025f, 1e-7f), 0, 0));
    EXPECT_THAT(Drawn({0, 4}), ElementsAre(0, 4));
    EXPECT_THAT(Drawn({5}), ElementsAre(5));
}

TEST(BlendName, IsThatOfTheFilterIfThereIsOne) {
    EXPECT_EQ(BlendName({3, 4, 3}, ""), "blend:bilateral=3,rd=4,nfor=3");
    EXPECT_EQ(BlendName({3, 0, 7}, "albedo-depth"),
              "blend:bilateral=3,rd=0,nfor=7,bilateral-without=albedo-depth");
    EXPECT_EQ(BlendName({0, 1, 1}, "albedo"), "blend:bilateral=0,rd=1,nfor=1");
    EXPECT_EQ(BlendName({2, 0, 0}, "depth"), "bilateral:mode=robust,without=depth");
    EXPECT_EQ(BlendName({0, 0, 9}, "depth"), "nfor");
}

class Blends : public testing::Test {
  protected:
    Frame frame_ = FrameFromFilm(MakeFilm({90, 50}, 8, 3));
    Result Filter(const std::string& filter) {
        return RunDenoiser(*MakeDenoiser(filter), frame_, CancelToken());
    }
};

TEST_F(Blends, OneFilterAloneIsThatFilter) {
    EXPECT_EQ(Filter("blend:bilateral=0,rd=1,nfor=0").color[1], Filter("rd").color[1]);
    EXPECT_EQ(Filter("blend:bilateral=1,rd=0,nfor=0,bilateral-without=albedo").color[1],
              Filter("bilateral:mode=robust,without=albedo").color[1]);
}

TEST_F(Blends, IsTheWeightedMeanWhereFiltersAgree) {
    const Result a = Filter("bilateral"), b = Filter("nfor");
    const Result mean = Filter("blend:bilateral=1,rd=0,nfor=3");
    for (std::size_t i = 0; i < frame_.pixel_count(); ++i) {
        const float expected = 0.25f * a.color[2][i] + 0.75f * b.color[2][i];
        ASSERT_NEAR(mean.color[2][i], expected, 1e-5f * (1 + expected));
        ASSERT_NEAR((*mean.error)[i], 0.25f * (*a.error)[i] + 0.75f * (*b.error)[i], 1e-5f);
    }
    EXPECT_THAT(mean.notes, Contains(Key("nfor.features")));
}

TEST_F(Blends, IsBetterThanItsBestPart) {
    const Truth truth{90, 50};
    const auto error = [&](const char* filter) {
        return MrSE(truth, Filter(filter).color, 0, truth.width);
    };
    EXPECT_LT(error("blend"), std::min({error("bilateral"), error("rd"), error("nfor")}));
}

}  // namespace
}  // namespace relume::denoise
