// What becomes of a job's options and of what its scene file asks for.
#include "client/cli/prepare_job.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "client/cli/exit_codes.h"
#include "core/base/files.h"

namespace relume::client {
namespace {

using testing::AllOf;
using testing::Contains;
using testing::HasSubstr;
using testing::Not;

constexpr const char* kSays =
    "Film \"rgb\" \"integer xresolution\" 320 \"integer yresolution\" 200\n"
    "Sampler \"sobol\" \"integer pixelsamples\" 64\n"
    "Integrator \"path\" \"integer maxdepth\" 20\n"
    "Camera \"perspective\" \"float fov\" 40\n";
constexpr const char* kWorld =
    "WorldBegin\nAreaLightSource \"diffuse\" \"rgb L\" [1 1 1]\nShape \"trianglemesh\" \"integer "
    "indices\" [0 1 2] \"point3 P\" [0 0 1 1 0 1 0 1 1]\n";

class PrepareJobTest : public testing::Test {
  protected:
    PrepareJobTest() { options_.scene = folder_.path() / "a.pbrt"; }
    PreparedJob Prepare(const std::string& text) {
        WriteFileAtomically(options_.scene, text);
        return PrepareJob(options_);
    }
    // The exit code and the message of the CommandError, or 0 and "".
    std::pair<int, std::string> Refusal(const std::string& text = kWorld) {
        try {
            Prepare(text);
            return {0, ""};
        } catch (const CommandError& error) {
            return {error.exit_code(), error.what()};
        }
    }

    TemporaryFolder folder_;
    JobOptions options_;
};

TEST_F(PrepareJobTest, WhatTheFileAsksForHoldsWhereNoOptionDoes) {
    const PreparedJob job = Prepare(std::string(kSays) + kWorld);
    EXPECT_EQ(job.spec.settings().width(), 320);
    EXPECT_EQ(job.spec.settings().height(), 200);
    EXPECT_EQ(job.spec.settings().max_depth(), 21);
    EXPECT_EQ(job.spec.spp(), 64);
    EXPECT_THAT(job.notes, Contains("as the scene file says: size 320x200, max depth 21, spp 64"));

    options_.size = Size{16, 8};
    options_.max_depth = 3;
    options_.budgets.spp = 2;
    const PreparedJob own = Prepare(std::string(kSays) + kWorld);
    EXPECT_EQ(own.spec.settings().width(), 16);
    EXPECT_EQ(own.spec.settings().height(), 8);
    EXPECT_EQ(own.spec.settings().max_depth(), 3);
    EXPECT_EQ(own.spec.spp(), 2);
    EXPECT_THAT(own.notes, Not(Contains(HasSubstr("as the scene file says"))));
}

TEST_F(PrepareJobTest, AFileThatAsksForNothingGetsTheDefaults) {
    options_.sampler = "uniform";
    const PreparedJob job = Prepare(kWorld);
    EXPECT_EQ(job.spec.settings().width(), 1280);
    EXPECT_EQ(job.spec.settings().max_depth(), 8);
    EXPECT_EQ(job.spec.spp(), 32);
    EXPECT_THAT(job.notes, Not(Contains(HasSubstr("as the scene file says"))));
}

TEST_F(PrepareJobTest, AnyBudgetTakesThePlaceOfTheScenesSamples) {
    const std::string scene = std::string(kSays) + kWorld;
    options_.budgets.min_spp = 6;
    EXPECT_EQ(Prepare(scene).spec.spp(), 64) << "a minimum is no budget";
    EXPECT_EQ(Prepare(scene).spec.min_spp(), 6u);
    for (const auto set : std::vector<void (*)(BudgetOptions*)>{
             [](BudgetOptions* b) { b->max_spp = 100; }, [](BudgetOptions* b) { b->target = 0.25; },
             [](BudgetOptions* b) { b->time_limit = 20; }}) {
        options_.budgets = {};
        set(&options_.budgets);
        const v1::JobSpec spec = Prepare(scene).spec;
        EXPECT_EQ(spec.spp(), 0);
        EXPECT_EQ(spec.max_spp(), options_.budgets.max_spp.value_or(0));
        EXPECT_EQ(spec.target(), options_.budgets.target.value_or(0));
        EXPECT_EQ(spec.time_limit(), options_.budgets.time_limit.value_or(0));
    }
}

TEST_F(PrepareJobTest, WithoutAnyBudgetAdaptiveGoesOnUntilAllIsConverged) {
    options_.sampler = "adaptive:pilot=4";
    const PreparedJob job = Prepare(kWorld);
    EXPECT_EQ(job.spec.spp(), 0);
    EXPECT_EQ(job.spec.target(), 0.005);
    EXPECT_FALSE(job.spec.has_max_spp());
    EXPECT_THAT(job.notes, Contains(HasSubstr("until the estimated RelMSE is 0.005")));
    EXPECT_EQ(Prepare(std::string(kSays) + kWorld).spec.spp(), 64);
}

TEST_F(PrepareJobTest, BudgetsThatExcludeEachOtherAreRefused) {
    options_.budgets.min_spp = 9;
    options_.budgets.spp = 8.5;
    const auto [code, message] = Refusal();
    EXPECT_EQ(code, kExitUsage);
    EXPECT_THAT(message, HasSubstr("min-spp 9 is more than spp 8.5"));
}

TEST_F(PrepareJobTest, StrictNamesAllThatWouldBeReplaced) {
    const std::string text =
        std::string(kSays) + "Option \"x\" 1\nWorldBegin\nShape \"nurbs\"\n" + kWorld;
    EXPECT_EQ(Prepare(text).notes.size(), 3u);  // and what the file asks for
    options_.strict = true;
    const auto [code, message] = Refusal(text);
    EXPECT_EQ(code, kExitInput);
    EXPECT_THAT(message, AllOf(HasSubstr("2 things"), HasSubstr("a.pbrt:5: the option 'x'"),
                               HasSubstr("a.pbrt:7: shapes of type nurbs"), HasSubstr("--strict")));
    EXPECT_EQ(Refusal(std::string(kSays) + kWorld).first, 0);
}

TEST_F(PrepareJobTest, ACameraOfTheJobsOwn) {
    options_.look_from = Vec3f{1, 2, 3};
    options_.look_at = Vec3f{0, 0, 1};
    options_.look_up = Vec3f{0, 0, 1};
    options_.fov = 55.0f;
    options_.strict = true;
    const PreparedJob job = Prepare(kWorld);
    const v1::LookCamera& look = job.spec.settings().look();
    EXPECT_EQ(look.from().y(), 2);
    EXPECT_EQ(look.at().z(), 1);
    EXPECT_EQ(look.up().z(), 1);
    EXPECT_EQ(look.fov_degrees(), 55);
    EXPECT_THAT(job.notes, Not(Contains(HasSubstr("camera"))));
}

TEST_F(PrepareJobTest, CamerasThatMakeNoSenseAreRefused) {
    const auto expect = [this](const char* what) {
        const auto [code, message] = Refusal();
        EXPECT_EQ(code, kExitUsage) << message;
        EXPECT_THAT(message, HasSubstr(what));
    };
    options_.fov = 20.0f;
    expect("--fov needs --look-from and --look-at");
    options_.look_from = Vec3f{0, 0, 0};
    expect("--look-from needs --look-at");
    options_.look_at = Vec3f{0, 0, 0};
    expect("same point");
    options_.look_at = Vec3f{0, 5, 0};
    expect("--look-up");
    options_.look_at = Vec3f{0, 0, 1};
    options_.camera = "front";
    expect("exclude each other");
    options_.camera = "";
    EXPECT_EQ(Refusal().first, 0);
    EXPECT_FALSE(Prepare(kWorld).spec.settings().look().has_up() &&
                 Prepare(kWorld).spec.settings().look().up().y() != 1);
}

}  // namespace
}  // namespace relume::client
