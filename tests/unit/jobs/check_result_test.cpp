#include "server/jobs/check_result.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <limits>

#include "core/base/error.h"
#include "core/film/aov.h"
#include "tests/unit/jobs/pseudo_renderer.h"

namespace relume::jobs {
namespace {

TileTask Task() { return {{4, 2, 7, 4}, {0, 1, 2, 3, 4, 5}, {4, 5, 0, 7, 64, 1}}; }

void ExpectRefused(const TileTask& task, const TileResult& result, const std::string& why) {
    try {
        CheckResult(task, result);
        FAIL() << "accepted, although: " << why;
    } catch (const Error& error) {
        EXPECT_EQ(error.code(), ErrorCode::kInvalidArgument);
        EXPECT_THAT(error.what(), testing::HasSubstr(why));
    }
}

TEST(CheckResult, AcceptsWhatTheTaskAsksFor) {
    EXPECT_NO_THROW(CheckResult(Task(), PseudoRender(Task())));
}

TEST(CheckResult, RefusesOtherShapes) {
    TileResult result = PseudoRender(Task());
    result.planes.pop_back();
    ExpectRefused(Task(), result, "are due");
    result = PseudoRender(Task());
    result.rect.x1 += 1;
    ExpectRefused(Task(), result, "are due");
    result = PseudoRender(Task());
    result.pixels[1] = 2;
    ExpectRefused(Task(), result, "pixel 2 where 1 is due");
}

TEST(CheckResult, RefusesValuesThatAreNone) {
    for (const float bad : {NAN, INFINITY, -INFINITY}) {
        TileResult result = PseudoRender(Task());
        result.planes[kMeanB * result.pixels.size() + 3] = bad;
        ExpectRefused(Task(), result, "mean_b.R");
    }
    TileResult result = PseudoRender(Task());
    result.planes[(kM2A + 1) * result.pixels.size()] = -1e-3f;
    ExpectRefused(Task(), result, "m2_a.G");
    result = PseudoRender(Task());
    for (const double seconds :
         {static_cast<double>(NAN), static_cast<double>(INFINITY), -1e-9, 1e300}) {
        result = PseudoRender(Task());
        result.seconds = seconds;
        ExpectRefused(Task(), result, "says that it took");
    }
    result = PseudoRender(Task());
    result.rays = ~std::uint64_t{0};
    ExpectRefused(Task(), result, "says that it traced");
}

TEST(CheckResult, RefusesAValueThatIsNoneWhereverItIs) {
    TileTask task{{0, 0, 33, 32}, {}, {}};
    task.first.assign(task.rect.area(), 0);
    task.count.assign(task.rect.area(), 2);
    TileResult result = PseudoRender(task);
    const std::size_t n = result.pixels.size();
    for (std::size_t channel = 0; channel < kFilmChannelCount; ++channel) {
        for (const std::size_t k : {std::size_t{0}, n / 2, n - 1}) {
            float& value = result.planes[channel * n + k];
            const float was = value;
            for (const float bad : {NAN, INFINITY, -INFINITY}) {
                value = bad;
                ExpectRefused(task, result, FilmChannelNames()[channel]);
            }
            value = was;
        }
    }
    EXPECT_NO_THROW(CheckResult(task, result));
    result.planes[kMeanA * n] = std::numeric_limits<float>::lowest();
    result.planes[kM2B * n] = std::numeric_limits<float>::max();
    result.planes[kMaxLuminance * n] = -0.0f;
    EXPECT_NO_THROW(CheckResult(task, result));
}

TEST(CheckResult, RefusesSamplesThatAreNotTheLeases) {
    TileTask task = Task();
    TileResult result = PseudoRender(task);
    std::vector<SampleRecord> samples(task.TotalSamples());
    task.keep_samples = true;
    ExpectRefused(task, result, "comes with 0 samples, 81 are due");
    result.samples = samples;
    EXPECT_NO_THROW(CheckResult(task, result));
    ExpectRefused(Task(), result, "comes with 81 samples, 0 are due");
    result.samples[4] = SampleRecord::Bad();  // the first of the second pixel
    ExpectRefused(task, result, "pixel 1 counts 0 bad samples");
}

TEST(CheckResult, RefusesCountsThatAreNotTheLeases) {
    TileResult result = PseudoRender(Task());
    const std::size_t n = result.pixels.size();
    result.planes[kCountA * n] += 1;
    ExpectRefused(Task(), result, "pixel 0 counts");
    // The sum is right, the halves are not.
    result = PseudoRender(Task());
    result.planes[kCountA * n] = 3;
    result.planes[kCountB * n] = 1;
    result.planes[kBadCount * n] = 0;
    ExpectRefused(Task(), result, "2 + 2 are due");
    result = PseudoRender(Task());
    result.planes[kCountA * n] = -1;
    result.planes[kBadCount * n] = 5;
    ExpectRefused(Task(), result, "pixel 0 counts");
}

}  // namespace
}  // namespace relume::jobs
