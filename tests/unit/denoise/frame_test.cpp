// Frames from films and from files, and the layers that are written.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>

#include "core/base/error.h"
#include "server/denoise/channel_names.h"
#include "server/denoise/output_image.h"
#include "tests/unit/denoise/synthetic.h"

namespace relume::denoise {
namespace {

using testing::Contains;
using testing::ElementsAre;
using testing::HasSubstr;
using testing::Not;

constexpr TileRect kCrop{7, 3, 47, 33};  // of 64 x 48
constexpr Truth kTruth{40, 30};

Film CropFilm() { return MakeFilm(kCrop, 64, 48, kTruth, 6, 1); }

Result NoFilter(const Frame& frame) {
    return RunDenoiser(*MakeDenoiser("none"), frame, CancelToken{});
}

Plane Of(const Image& image, const std::string& channel) {
    const auto plane = image.Plane(channel);
    return {plane.begin(), plane.end()};
}

TEST(FrameFromFilm, MeansAndVariancesAreTheFilms) {
    const Film film = CropFilm();
    const Frame frame = FrameFromFilm(film);
    double sample = 0, halves = 0;
    for (std::size_t i = 0; i < film.pixel_count(); ++i) {
        ASSERT_EQ(frame.count[i], 6);
        for (int c = 0; c < 3; ++c) {
            ASSERT_NEAR(frame.color[c][i], film.Mean(i)[c], 1e-5);
        }
        sample += frame.variance[1][i];
        halves += film.HalfVariance(i)[1];
    }
    EXPECT_NEAR(sample / halves, 1, 0.1);  // regularised: the halves' level
}

TEST(FrameFromFilm, VarianceIsRightOnAverage) {
    const Truth truth{100, 80};
    const Frame frame = FrameFromFilm(MakeFilm(truth, 8, 2));
    double ratio = 0;
    for (std::size_t i = 0; i < frame.pixel_count(); ++i) {
        const float color = truth.Color(static_cast<int>(i) % 100, static_cast<int>(i) / 100)[0];
        ratio += frame.sample_variance[0][i] / (color * color / 8);
    }
    // An exponential variable's sample variance of 8 has a relative deviation of 1.1: 0.012 for
    // 8000.
    EXPECT_NEAR(ratio / 8000, 1, 0.05);
}

TEST(OutputImage, BasicLayersAreTheListed) {
    const Film film = CropFilm();
    const Frame frame = FrameFromFilm(film);
    const ErrorEstimate error = EstimateNoisy(frame);
    const Image image = AssembleOutput(film, frame, NoFilter(frame), &error, false);
    EXPECT_THAT(image.channels(),
                testing::UnorderedElementsAre("R", "G", "B", "A", "noisy.R", "noisy.G", "noisy.B",
                                              "albedo.R", "albedo.G", "albedo.B", "N.X", "N.Y",
                                              "N.Z", "Z", "visibility.Y", "variance.R",
                                              "variance.G", "variance.B", "samples.Y", "relmse.Y"));
}

TEST(OutputImage, WindowsAreTheFilms) {
    const Film film = CropFilm();
    const Frame frame = FrameFromFilm(film);
    const Image image = AssembleOutput(film, frame, NoFilter(frame), nullptr, false);
    EXPECT_EQ(image.width(), 40);
    EXPECT_EQ(image.height(), 30);
    EXPECT_EQ(image.x0(), 7);
    EXPECT_EQ(image.y0(), 3);
    EXPECT_EQ(image.display_width(), 64);
    EXPECT_EQ(image.display_height(), 48);
}

TEST(OutputImage, LayersHoldWhatTheirNamesSay) {
    const Film film = CropFilm();
    const Frame frame = FrameFromFilm(film);
    Result result = NoFilter(frame);
    for (int c = 0; c < 3; ++c) {
        result.color[c].assign(frame.pixel_count(), 10.0f + static_cast<float>(c));
    }
    ErrorEstimate error;
    error.map.assign(frame.pixel_count(), 0.25f);
    const Image image = AssembleOutput(film, frame, result, &error, true);
    EXPECT_EQ(Of(image, "G"), Plane(frame.pixel_count(), 11));
    EXPECT_EQ(Of(image, "A"), Plane(frame.pixel_count(), 1));
    EXPECT_EQ(Of(image, "noisy.B"), frame.color[2]);
    EXPECT_EQ(Of(image, "variance.R"), frame.variance[0]);
    EXPECT_EQ(Of(image, "samples.Y"), Plane(frame.pixel_count(), 6));
    EXPECT_EQ(Of(image, "buffer_a.R"), frame.half[0][0]);
    EXPECT_EQ(Of(image, "buffer_b.B"), frame.half[1][2]);
    for (const std::size_t i : {0u, 25u, 41u * 7}) {
        const int x = static_cast<int>(i) % 40, y = static_cast<int>(i) / 40;
        const PixelSample features = kTruth.Features(x, y);
        for (std::size_t f = 0; f < kFeatureCount; ++f) {
            EXPECT_NEAR(image.Plane(FeatureName(static_cast<int>(f)))[i], features.features[f],
                        1e-6);
        }
        EXPECT_NEAR(image.Plane("relmse.Y")[i], 0.25, 1e-6);
    }
}

TEST(OutputImage, FeatureVarianceIsOfTheMean) {
    std::mt19937 rng(3);
    const Film film = MakeFilm(kTruth, 8, 4, [&](int, int, int, PixelSample* sample) {
        sample->features[kDepth] = static_cast<float>(5 + Normal(&rng));
        sample->features[kNormalY] = static_cast<float>(0.1 * Normal(&rng));
    });
    const Frame frame = FrameFromFilm(film);
    const Image image = AssembleOutput(film, frame, NoFilter(frame), nullptr, true);
    double depth = 0, normal = 0;
    for (std::size_t i = 0; i < frame.pixel_count(); ++i) {
        depth += image.Plane("Z_variance")[i] / 1200.0;
        normal += image.Plane("N_variance.Y")[i] / 1200.0;
    }
    // 7 degrees of freedom a pixel, 1200 pixels: 1.5 % deviation.
    EXPECT_NEAR(depth * 8, 1, 0.06);
    EXPECT_NEAR(normal * 8, 0.01, 0.0006);
}

TEST(FrameFromImage, ReadsBackWhatIsWritten) {
    const Film film = CropFilm();
    const Frame frame = FrameFromFilm(film);
    const Result filtered = RunDenoiser(*MakeDenoiser("bilateral"), frame, CancelToken{});
    std::vector<std::string> notes;
    const Frame again =
        FrameFromImage(AssembleOutput(film, frame, filtered, nullptr, true), &notes);
    EXPECT_THAT(notes, ElementsAre(HasSubstr("noisy.R")));
    for (int c = 0; c < 3; ++c) {
        EXPECT_EQ(again.color[c], frame.color[c]);
        EXPECT_EQ(again.variance[c], frame.variance[c]);
        EXPECT_EQ(again.half[0][c], frame.half[0][c]);
        EXPECT_EQ(again.half[1][c], frame.half[1][c]);
    }
    EXPECT_EQ(again.count, frame.count);
    for (int f = 0; f < kFeatureCount; ++f) {
        EXPECT_EQ(again.feature[f], frame.feature[f]);
        EXPECT_FALSE(frame.feature_half[0][f].empty());
        EXPECT_EQ(again.feature_half[0][f], frame.feature_half[0][f]);
        EXPECT_EQ(again.feature_half[1][f], frame.feature_half[1][f]);
        ASSERT_EQ(again.feature_variance[f].size(), frame.feature_variance[f].size());
        for (std::size_t i = 0; i < frame.pixel_count(); ++i) {
            // Divided by the count and multiplied again.
            ASSERT_FLOAT_EQ(again.feature_variance[f][i], frame.feature_variance[f][i]);
        }
    }
    const Result result = RunDenoiser(*MakeDenoiser("bilateral"), again, CancelToken{});
    for (std::size_t i = 0; i < frame.pixel_count(); ++i) {
        ASSERT_NEAR(result.color[0][i], filtered.color[0][i], 1e-5);
    }
}

// An image whose channel k holds k + 1 everywhere.
Image Numbered(const std::vector<std::string>& channels) {
    Image image(4, 3, channels);
    for (std::size_t k = 0; k < channels.size(); ++k) {
        std::ranges::fill(image.Plane(static_cast<int>(k)), static_cast<float>(k + 1));
    }
    return image;
}

TEST(FrameFromImage, KnowsBlendersNames) {
    std::vector<std::string> notes;
    const Frame frame = FrameFromImage(
        Numbered({"ViewLayer.Combined.R", "ViewLayer.Combined.G", "ViewLayer.Combined.B",
                  "ViewLayer.Combined.A", "ViewLayer.Denoising Albedo.R",
                  "ViewLayer.Denoising Albedo.G", "ViewLayer.Denoising Albedo.B",
                  "ViewLayer.Denoising Normal.X", "ViewLayer.Denoising Normal.Y",
                  "ViewLayer.Denoising Normal.Z", "ViewLayer.Denoising Depth.Z"}),
        &notes);
    EXPECT_EQ(frame.color[2][0], 3);
    EXPECT_EQ(frame.feature[kAlbedoR][0], 5);
    EXPECT_EQ(frame.feature[kNormalY][0], 9);
    EXPECT_EQ(frame.feature[kDepth][0], 11);
    EXPECT_TRUE(frame.count.empty());
    EXPECT_FALSE(frame.has_halves());
    EXPECT_THAT(notes, ElementsAre(HasSubstr("variance: none in the file")));
}

TEST(FrameFromImage, PrefersBlendersNoisyImage) {
    const Frame frame =
        FrameFromImage(Numbered({"V.Combined.R", "V.Combined.G", "V.Combined.B", "V.Noisy Image.B",
                                 "V.Noisy Image.G", "V.Noisy Image.R"}),
                       nullptr);
    EXPECT_EQ(frame.color[0][0], 6);
    EXPECT_EQ(frame.color[2][0], 4);
}

TEST(FrameFromImage, KnowsPbrtsNames) {
    const std::vector<std::string> channels = {
        "R",    "G",    "B",    "Albedo.R",   "Albedo.G",   "Albedo.B",
        "P.X",  "P.Y",  "P.Z",  "N.X",        "N.Y",        "N.Z",
        "Ns.X", "Ns.Y", "Ns.Z", "Variance.R", "Variance.G", "Variance.B"};
    std::vector<std::string> notes;
    Frame frame = FrameFromImage(Numbered(channels), &notes);
    EXPECT_EQ(frame.color[0][0], 1);
    EXPECT_EQ(frame.feature[kAlbedoB][0], 6);
    EXPECT_EQ(frame.feature[kNormalX][0], 13);  // the shading normal
    EXPECT_EQ(frame.feature[kDepth][0], 9);
    // Its variance is of a sample: of no use without the count.
    EXPECT_EQ(frame.variance[0][0], 0);
    Image counted = Numbered(channels);
    std::ranges::fill(counted.Plane(counted.Add("samples.Y")), 4.0f);
    frame = FrameFromImage(counted, &notes);
    EXPECT_EQ(frame.variance[0][0], 4);
    EXPECT_THAT(notes, Contains(HasSubstr("of one sample, over the sample count")));
}

TEST(FrameFromImage, VarianceFromTheHalvesIfThereIsNoOther) {
    Image image(9, 9,
                {"R", "G", "B", "buffer_a.R", "buffer_a.G", "buffer_a.B", "buffer_b.R",
                 "buffer_b.G", "buffer_b.B"});
    std::ranges::fill(image.Plane("buffer_a.G"), 3.0f);
    std::ranges::fill(image.Plane("buffer_b.G"), 1.0f);
    std::vector<std::string> notes;
    const Frame frame = FrameFromImage(image, &notes);
    EXPECT_THAT(notes, Contains(HasSubstr("buffer_a and buffer_b")));
    EXPECT_FLOAT_EQ(frame.variance[1][0], 1);  // (A - B)^2 / 4
    EXPECT_FLOAT_EQ(frame.variance[1][40], 1);
    EXPECT_EQ(frame.variance[0][40], 0);
}

TEST(FrameFromImage, VarianceFromNeighboursIsRightOnFlatGround) {
    std::mt19937 rng(5);
    Image image(120, 100, {"R", "G", "B"});
    for (float& value : image.Plane("R")) {
        value = static_cast<float>(1 + 0.1 * Normal(&rng));
    }
    for (int i = 0; i < 12000; ++i) {  // a ramp has none
        image.Plane("G")[static_cast<std::size_t>(i)] =
            0.01f * static_cast<float>(i % 120 + i / 120);
    }
    const Frame frame = FrameFromImage(image, nullptr);
    double mean = 0;
    for (std::size_t i = 0; i < frame.pixel_count(); ++i) {
        mean += frame.variance[0][i] / 12000.0;
        ASSERT_NEAR(frame.variance[1][i], 0, 1e-9);
    }
    // Squared responses overlap; some 3000 independent ones: 2.5 % deviation.
    EXPECT_NEAR(mean, 0.01, 0.001);
}

TEST(FrameFromImage, RepairsPixelsAndSaysSo) {
    Image image = Numbered({"R", "G", "B", "variance.R", "variance.G", "variance.B", "N.X", "N.Y",
                            "N.Z", "albedo.R", "albedo.G", "albedo.B", "Z"});
    image.Plane("G")[5] = NAN;
    image.Plane("R")[11] = INFINITY;
    image.Plane("variance.R")[0] = -1;
    image.Plane("variance.R")[1] = 7;
    image.Plane("N.X")[3] = NAN;
    std::vector<std::string> notes;
    const Frame frame = FrameFromImage(image, &notes);
    EXPECT_THAT(notes, ElementsAre(HasSubstr("2 pixels without a finite colour")));
    EXPECT_EQ(frame.color[0][5], 1);
    EXPECT_EQ(frame.color[1][5], 2);
    EXPECT_EQ(frame.color[0][11], 1);
    EXPECT_EQ(frame.variance[0][0], 7);  // the largest of its neighbours'
    EXPECT_EQ(frame.variance[0][5], 7);
    EXPECT_EQ(frame.feature[kNormalX][3], 7);
    EXPECT_EQ(frame.flagged[5], 1);
    EXPECT_EQ(frame.flagged[11], 1);
    EXPECT_EQ(frame.flagged[3], 0);
}

TEST(FrameFromImage, AMissIsAsFarAsTheFarthestHit) {
    Image image = Numbered({"R", "G", "B", "Depth.Z"});
    const float depths[] = {1, 2, 1e10f, INFINITY, 4, NAN, 3, 65504, 1, 1, 1, 1};
    std::ranges::copy(depths, image.Plane("Depth.Z").begin());
    Frame frame = FrameFromImage(image, nullptr);
    EXPECT_EQ(frame.feature[kDepth][0], 1);
    EXPECT_EQ(frame.feature[kDepth][2], 65504);
    EXPECT_EQ(frame.feature[kDepth][3], 65504);
    EXPECT_LE(frame.feature[kDepth][5], 65504);
    std::ranges::fill(image.Plane("Depth.Z"), INFINITY);
    frame = FrameFromImage(image, nullptr);
    EXPECT_EQ(frame.feature[kDepth], Plane(12, 0.0f));
}

TEST(FrameFromImage, RefusesWhatHasNoColourOrNoPixel) {
    try {
        (void)FrameFromImage(Numbered({"albedo.R", "albedo.G", "albedo.B", "R", "G"}), nullptr);
        FAIL() << "taken";
    } catch (const Error& error) {
        EXPECT_EQ(error.code(), ErrorCode::kInvalidArgument);
        EXPECT_THAT(error.what(), HasSubstr("no colour"));
        EXPECT_THAT(error.what(), HasSubstr("albedo.R"));
    }
    EXPECT_THROW((void)FrameFromImage(Image(0, 0, {"R", "G", "B"}), nullptr), Error);
}

TEST(ChannelNames, SelectLayerTakesWhatIsBelowIt) {
    const Image image = Numbered({"A.Combined.R", "A.Combined.G", "A.Combined.B", "AB.Combined.R",
                                  "AB.Combined.G", "AB.Combined.B"});
    const Image selected = SelectLayer(image, "AB");
    EXPECT_THAT(selected.channels(), ElementsAre("Combined.R", "Combined.G", "Combined.B"));
    EXPECT_EQ(FrameFromImage(selected, nullptr).color[0][0], 4);
    EXPECT_EQ(FrameFromImage(image, nullptr).color[0][0], 1);  // the file's first
    try {
        (void)SelectLayer(image, "C");
        FAIL() << "taken";
    } catch (const Error& error) {
        EXPECT_THAT(error.what(), HasSubstr("there are A, AB"));
    }
}

}  // namespace
}  // namespace relume::denoise
