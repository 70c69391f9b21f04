#include "core/image/metrics.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <filesystem>
#include <nlohmann/json.hpp>

#include "core/base/error.h"
#include "core/base/files.h"
#include "core/base/parallel.h"
#include "core/image/exr.h"
#include "tests/unit/image/noise_images.h"

namespace relume {
namespace {

constexpr double kNaN = std::numeric_limits<double>::quiet_NaN();

struct Case {
    int width, height;
    std::uint32_t seed;
    bool bad;
    ImageError expected;  // shared metrics.py's figures of NoisePair(); energy is not among them
};

const std::array<Case, 6> kCases = {{
    {64,
     48,
     1u,
     false,
     {528.378363, 16.9725177, 136.993559, 0.971367735, 23.519117, 0.146088676, 0, 0}},
    {65,
     33,
     2u,
     true,
     {1723.15208, 123.011193, 181.05684, 0.88957094, 17.4593607, 0.176039896, 0, 40}},
    {11,
     11,
     3u,
     false,
     {3598.82244, 3598.82244, 1655.1073, 0.972419865, 22.8487245, 0.186552252, 0, 0}},
    {13,
     97,
     4u,
     true,
     {141.306959, 101.284266, 48.519558, 0.88180798, 17.7955573, 0.167595241, 0, 23}},
    {200,
     15,
     5u,
     false,
     {86.380683, 17.6371459, 74.6651174, 0.967554237, 23.6242653, 0.149038022, 0, 0}},
    {7, 5, 6u, true, {1328.93725, 1328.93725, 1180.72736, kNaN, 17.385557, 0.263140748, 0, 2}},
}};

// 1e-5, relative for figures above 1.
void ExpectAgree(double ours, double theirs, const char* what) {
    if (std::isnan(theirs)) {
        EXPECT_TRUE(std::isnan(ours)) << what << " is " << ours;
        return;
    }
    EXPECT_NEAR(ours, theirs, 1e-5 * std::max(1.0, std::abs(theirs))) << what;
}

void ExpectAgree(const ImageError& ours, const ImageError& theirs) {
    ExpectAgree(ours.mrse, theirs.mrse, "MrSE");
    ExpectAgree(ours.mrse_trimmed, theirs.mrse_trimmed, "trimmed MrSE");
    ExpectAgree(ours.relmse, theirs.relmse, "RelMSE");
    ExpectAgree(ours.ssim, theirs.ssim, "SSIM");
    ExpectAgree(ours.psnr, theirs.psnr, "PSNR");
    ExpectAgree(ours.flip, theirs.flip, "FLIP");
    EXPECT_EQ(ours.bad, theirs.bad);
}

TEST(Metrics, AgreeWithGoldenFigures) {
    for (const Case& c : kCases) {
        SCOPED_TRACE(testing::Message() << c.width << "x" << c.height << " seed " << c.seed);
        const auto [reference, test] = NoisePair(c.width, c.height, c.seed, c.bad);
        ExpectAgree(CompareImages(reference, test), c.expected);
    }
}

// Output of a command; empty if it fails.
std::string OutputOf(const std::string& command) {
    std::FILE* pipe = popen(command.c_str(), "r");
    if (pipe == nullptr) {
        return "";
    }
    std::string out;
    std::array<char, 4096> buffer;
    while (const std::size_t n = std::fread(buffer.data(), 1, buffer.size(), pipe)) {
        out.append(buffer.data(), n);
    }
    return pclose(pipe) == 0 ? out : "";
}

TEST(Metrics, AgreeWithTheScriptOnExrFiles) {
    const std::string script = RELUME_SOURCE_DIR "/../shared/metrics.py";
    if (!std::filesystem::exists(script)) {
        GTEST_SKIP() << "there is no ../shared/metrics.py";
    }
    if (OutputOf("/usr/bin/python3 '" + script + "' --help 2>/dev/null").empty()) {
        GTEST_SKIP() << "metrics.py needs python3 with numpy, scipy and OpenImageIO";
    }
    const TemporaryFolder folder;
    const auto reference_path = folder.path() / "ref.exr", test_path = folder.path() / "test.exr";
    for (const Case& c : kCases) {
        SCOPED_TRACE(testing::Message() << c.width << "x" << c.height << " seed " << c.seed);
        auto [reference, test] = NoisePair(c.width, c.height, c.seed, c.bad);
        reference.SetWindow(3, 5, 300, 200);  // a crop: the data window alone counts
        WriteExr(reference_path, reference);
        WriteExr(test_path, test);
        const std::string out =
            OutputOf("/usr/bin/python3 -W ignore '" + script + "' --json '" +
                     reference_path.string() + "' '" + test_path.string() + "'");
        // Python writes NaN, which JSON has not.
        const auto nan = out.find("NaN");
        const auto json =
            nlohmann::json::parse(nan == out.npos ? out : std::string(out).replace(nan, 3, "null"));
        const ImageError theirs{json["MrSE"],
                                json["MrSE.trim"],
                                json["RelMSE"],
                                json["SSIM"].is_null() ? kNaN : json["SSIM"].get<double>(),
                                json["PSNR"],
                                json["FLIP"],
                                0,
                                json["bad"]};
        ExpectAgree(CompareImages(ReadExr(reference_path), ReadExr(test_path)), theirs);
        ExpectAgree(theirs, c.expected);
    }
}

TEST(Metrics, AnImageIsEqualToItself) {
    const auto [image, other] = NoisePair(40, 20, 7, false);
    const ImageError error = CompareImages(image, image);
    EXPECT_EQ(error.mrse, 0);
    EXPECT_EQ(error.mrse_trimmed, 0);
    EXPECT_EQ(error.relmse, 0);
    EXPECT_NEAR(error.ssim, 1, 1e-12);  // rounding of a quotient
    EXPECT_TRUE(std::isinf(error.psnr));
    EXPECT_EQ(error.flip, 0);
    EXPECT_EQ(error.energy, 1);
    EXPECT_EQ(error.bad, 0);
}

TEST(Metrics, EnergyIsTheRatioOfMeans) {
    Image reference(2, 1, {"R", "G", "B"}), test(2, 1, {"R", "G", "B"});
    reference.Plane("R")[0] = 4;
    test.Plane("B")[1] = 3;
    EXPECT_EQ(CompareImages(reference, test).energy, 0.75);
}

TEST(Metrics, ABadPixelInBothImagesCountsTwiceAndIsBlack) {
    Image reference(2, 1, {"R", "G", "B"}), test(2, 1, {"R", "G", "B"});
    reference.Plane("R")[0] = test.Plane("G")[0] = std::numeric_limits<float>::infinity();
    reference.Plane("B")[0] = 5;
    const ImageError error = CompareImages(reference, test);
    EXPECT_EQ(error.bad, 2);
    EXPECT_EQ(error.mrse, 0);
}

TEST(Metrics, NegativePixelsOfTheTestImageAreCounted) {
    Image reference(4, 1, {"R", "G", "B"}), test(4, 1, {"R", "G", "B"});
    reference.Plane("R")[0] = -1;
    test.Plane("R")[1] = test.Plane("B")[1] = test.Plane("G")[3] = -1e-20f;
    EXPECT_EQ(CompareImages(reference, test).negative, 2);
}

TEST(Metrics, ReadTheLayersAskedFor) {
    Image image(1, 1, {"R", "G", "B", "noisy.R", "noisy.G", "noisy.B"});
    image.Plane("noisy.R")[0] = 1;
    EXPECT_EQ(CompareImages(image, image).mrse, 0);
    EXPECT_NEAR(CompareImages(image, image, "", "noisy").mrse, 1 / 0.001 / 3, 1e-9);
    EXPECT_NEAR(CompareImages(image, image, "noisy", "").mrse, 1 / 1.001 / 3, 1e-12);
}

TEST(Metrics, FlipIsLeftOutOnRequest) {
    const auto [reference, test] = NoisePair(12, 12, 8, false);
    EXPECT_EQ(CompareImages(reference, test, "", "", false).flip, 0);
}

TEST(Metrics, DoNotDependOnTheNumberOfThreads) {
    const auto [reference, test] = NoisePair(120, 70, 9, true);
    SetThreadCount(1);
    const ImageError one = CompareImages(reference, test);
    SetThreadCount(3);
    const ImageError three = CompareImages(reference, test);
    SetThreadCount(0);
    EXPECT_EQ(one.flip, three.flip);
    EXPECT_EQ(one.ssim, three.ssim);
    EXPECT_EQ(one.mrse, three.mrse);
}

TEST(Metrics, RejectWhatCannotBeCompared) {
    const Image small(4, 4, {"R", "G", "B"}), large(5, 4, {"R", "G", "B"}), grey(4, 4, {"Y"});
    const auto message = [](const Image& a, const Image& b, const std::string& layer) {
        try {
            CompareImages(a, b, layer);
        } catch (const Error& e) {
            EXPECT_EQ(e.code(), ErrorCode::kInvalidArgument);
            return std::string(e.what());
        }
        return std::string();
    };
    EXPECT_THAT(message(small, large, ""), testing::HasSubstr("4x4, test 5x4"));
    EXPECT_THAT(message(small, grey, ""), testing::HasSubstr("test image has no channel 'R'"));
    EXPECT_THAT(message(small, small, "noisy"),
                testing::HasSubstr("reference has no channel 'noisy.R'; it has R, G, B"));
    EXPECT_THAT(message(Image(0, 0, {"R", "G", "B"}), Image(0, 0, {"R", "G", "B"}), ""),
                testing::HasSubstr("without pixels"));
}

}  // namespace
}  // namespace relume
