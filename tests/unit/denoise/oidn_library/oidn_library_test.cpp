// Filter `oidn` by Open Image Denoise's own library, or what stands in for it here.
#include "server/denoise/oidn_library.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cstdlib>
#include <set>
#include <string>

#include "core/base/error.h"
#include "server/denoise/denoiser.h"
#include "server/denoise/net.h"
#include "tests/unit/denoise/oidn_library/stand_in.h"
#include "tests/unit/denoise/synthetic.h"

namespace relume::denoise {
namespace {

using stand_in::Runs;
using testing::ElementsAre;
using testing::Pair;
using testing::UnorderedElementsAre;

class OidnLibrary : public testing::Test {
  protected:
    void SetUp() override {
        setenv("RELUME_NETWORKS", "/nowhere", 1);  // its weights are the library's own
        Runs().clear();
        SetFeatureVariance(0.1f);
    }
    void TearDown() override { EXPECT_EQ(stand_in::LiveFilters(), 0); }

    void SetFeatureVariance(float variance) {
        for (Plane& plane : frame_.feature_variance) {
            plane.assign(frame_.pixel_count(), variance);
        }
    }

    Frame frame_ = FrameFromFilm(MakeFilm({30, 20}, 4, 3));
};

void ExpectHalf(const Result& result, const Frame& frame) {
    for (int c = 0; c < 3; ++c) {
        for (std::size_t i = 0; i < frame.pixel_count(); ++i) {
            ASSERT_EQ(result.color[c][i], 0.5f * frame.color[c][i]) << c << " " << i;
        }
    }
}

TEST_F(OidnLibrary, PrefiltersFeaturesByItself) {
    const Result result = MakeDenoiser("oidn")->Reconstruct(frame_, CancelToken());
    ExpectHalf(result, frame_);
    EXPECT_EQ(result.notes.at("engine"), "Open Image Denoise's library");
    EXPECT_EQ(result.notes.at("features"), "prefiltered");
    ASSERT_EQ(Runs().size(), 3u);
    EXPECT_THAT(Runs()[0].images, ElementsAre("albedo"));
    EXPECT_THAT(Runs()[0].parameters, ElementsAre(Pair("quality", OIDN_QUALITY_BALANCED)));
    EXPECT_THAT(Runs()[1].images, ElementsAre("normal"));
    EXPECT_THAT(Runs()[2].images, ElementsAre("albedo", "color", "normal"));
    EXPECT_THAT(Runs()[2].parameters, UnorderedElementsAre(Pair("cleanAux", 1), Pair("hdr", 1),
                                                           Pair("quality", OIDN_QUALITY_BALANCED)));
}

TEST_F(OidnLibrary, CleanFeaturesAreNotPrefiltered) {
    SetFeatureVariance(0);
    (void)MakeDenoiser("oidn")->Reconstruct(frame_, CancelToken());
    ASSERT_EQ(Runs().size(), 1u);
    EXPECT_EQ(Runs()[0].parameters.at("cleanAux"), 1);
}

TEST_F(OidnLibrary, SizesAreItsQualities) {
    for (const auto& [filter, quality] : {std::pair{"oidn:size=small", OIDN_QUALITY_FAST},
                                          {"oidn:features=noisy", OIDN_QUALITY_BALANCED},
                                          {"oidn:size=large", OIDN_QUALITY_HIGH}}) {
        (void)MakeDenoiser(filter)->Reconstruct(frame_, CancelToken());
        EXPECT_EQ(Runs().back().parameters.at("quality"), quality) << filter;
    }
    EXPECT_THROW((void)MakeDenoiser("oidn:size=large,features=noisy"), Error);
}

TEST_F(OidnLibrary, LooksAtWhatThereIs) {
    (void)MakeDenoiser("oidn:features=noisy")->Reconstruct(frame_, CancelToken());
    EXPECT_THAT(Runs().back().images, ElementsAre("albedo", "color", "normal"));
    EXPECT_EQ(Runs().back().parameters.at("cleanAux"), 0);
    (void)MakeDenoiser("oidn:features=none")->Reconstruct(frame_, CancelToken());
    EXPECT_THAT(Runs().back().images, ElementsAre("color"));
    frame_.feature[kNormalX].clear();
    (void)MakeDenoiser("oidn")->Reconstruct(frame_, CancelToken());
    EXPECT_THAT(Runs().back().images, ElementsAre("albedo", "color"));
    EXPECT_EQ(Runs().back().parameters.at("cleanAux"), 0);
    EXPECT_EQ(Runs().size(), 3u);
}

TEST_F(OidnLibrary, IsWhatNetMixesWithoutWeightsOfItsNetworks) {
    EXPECT_TRUE(HasNetSlot(kOidnSlot));
    const Result result = MakeDenoiser("net:candidates=oidn")->Reconstruct(frame_, CancelToken());
    EXPECT_EQ(Runs().size(), 3u);
    EXPECT_TRUE(result.notes.contains("share.oidn"));
}

TEST_F(OidnLibrary, WhatItSaysOfAFailureIsTheError) {
    const auto denoiser = MakeDenoiser("oidn:features=noisy");
    for (const auto& [error, code] :
         {std::pair{OIDN_ERROR_OUT_OF_MEMORY, ErrorCode::kResourceExhausted},
          {OIDN_ERROR_UNSUPPORTED_HARDWARE, ErrorCode::kInternal}}) {
        stand_in::Fail(error, "no luck");
        try {
            (void)denoiser->Reconstruct(frame_, CancelToken());
            FAIL();
        } catch (const Error& thrown) {
            EXPECT_EQ(thrown.code(), code);
            EXPECT_THAT(thrown.what(), testing::HasSubstr("library: no luck"));
        }
        ExpectHalf(denoiser->Reconstruct(frame_, CancelToken()), frame_);
    }
}

TEST_F(OidnLibrary, EndsWhenItIsCancelled) {
    CancelToken cancel;
    stand_in::OnHalf([](void* token) { static_cast<CancelToken*>(token)->Cancel(); }, &cancel);
    try {
        (void)MakeDenoiser("oidn:features=noisy")->Reconstruct(frame_, cancel);
        FAIL();
    } catch (const Error& thrown) {
        EXPECT_EQ(thrown.code(), ErrorCode::kCancelled);
    }
    ExpectHalf(MakeDenoiser("oidn:features=noisy")->Reconstruct(frame_, CancelToken()), frame_);
}

}  // namespace
}  // namespace relume::denoise
