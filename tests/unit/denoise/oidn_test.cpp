#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <cstdlib>
#include <filesystem>

#include "core/base/error.h"
#include "core/base/files.h"
#include "core/base/parallel.h"
#include "server/denoise/denoiser.h"
#include "server/denoise/network/weights.h"
#include "server/denoise/oidn_transfer.h"
#include "tests/unit/denoise/authors_rows.h"
#include "tests/unit/denoise/reference_network.h"
#include "tests/unit/denoise/synthetic.h"

namespace relume::denoise {
namespace {

using testing::AllOf;
using testing::HasSubstr;

TEST(OidnTransfer, IsTheCurveOfTheMethod) {
    // A x below Y0, B x^C + D below Y1, E ln(x + F) + G above, over its value at 65504.
    const double largest = 0.192653254 * std::log(65504 + 0.00626026094) + 0.998620152;
    EXPECT_NEAR(ToPu(1e-6f), 1412.83765 * 1e-6 / largest, 1e-9);
    EXPECT_NEAR(ToPu(0.01f), (1.64593172 * std::pow(0.01, 0.431384981) - 0.00294139609) / largest,
                1e-7);
    EXPECT_NEAR(ToPu(3), (0.192653254 * std::log(3.00626026094) + 0.998620152) / largest, 1e-7);
    EXPECT_EQ(ToPu(0), 0);
    EXPECT_EQ(ToPu(-4), 0);
    EXPECT_FLOAT_EQ(ToPu(65504), 1);
}

TEST(OidnTransfer, Inverts) {
    float before = -1;
    for (float x = 1e-8f; x < 1e6f; x *= 1.1f) {
        EXPECT_GT(ToPu(x), before);
        before = ToPu(x);
        EXPECT_NEAR(FromPu(ToPu(x)) / x, 1, 2e-4) << x;  // near the joints, the curve's own steps
    }
    EXPECT_EQ(FromPu(0), 0);
    EXPECT_EQ(FromPu(-1), 0);
    for (float x = 0; x <= 1; x += 0.01f) {
        EXPECT_NEAR(FromSrgb(ToSrgb(x)), x, 1e-6);
    }
    EXPECT_NEAR(ToSrgb(0.2140411f), 0.5, 1e-6);
}

TEST(OidnTransfer, ExposureIsTheKeyOverTheGeometricMean) {
    Plane color[3];
    for (Plane& plane : color) {
        for (int i = 0; i < 64 * 32; ++i) {
            plane.push_back(i % 64 < 16 ? 0.0f : i % 64 < 32 ? 2.0f : 8.0f);  // 0, 2, 8, 8
        }
    }
    EXPECT_NEAR(AutoExposure(color, 64, 32), 0.18 / std::exp2((1 + 3 + 3) / 3.0), 1e-6);
    for (Plane& plane : color) {
        plane.assign(plane.size(), 0.0f);
    }
    EXPECT_EQ(AutoExposure(color, 64, 32), 1);
    for (Plane& plane : color) {
        plane.assign(1, 0.5f);
    }
    EXPECT_NEAR(AutoExposure(color, 1, 1), 0.36, 1e-6);
}

// Sets a variable of the environment for a scope.
class Variable {
  public:
    Variable(const char* name, const std::string& value) : name_(name) {
        const char* before = std::getenv(name);
        if (before) {
            before_ = before;
        }
        setenv(name, value.c_str(), 1);
    }
    ~Variable() {
        if (before_) {
            setenv(name_, before_->c_str(), 1);
        } else {
            unsetenv(name_);
        }
    }
    Variable(const Variable&) = delete;
    Variable& operator=(const Variable&) = delete;

  private:
    const char* name_;
    std::optional<std::string> before_;
};

TEST(NetworkWeights, AreLookedForInTheirFolders) {
    const TemporaryFolder chosen, data;
    const Variable networks("RELUME_NETWORKS", chosen.path().string());
    const Variable xdg("XDG_DATA_HOME", data.path().string());
    EXPECT_FALSE(FindNetworkWeights("some"));
    EXPECT_THAT(NetworkFolders(),
                AllOf(HasSubstr(chosen.path().string()), HasSubstr("share/relume/networks"),
                      HasSubstr(data.path().string() + "/relume/networks")));

    TensorArchive archive;
    AddWeights("a", 1, 2, 3, 1, &archive);
    const auto write = [&](const std::filesystem::path& folder) {
        std::filesystem::create_directories(folder);
        WriteFileAtomically(folder / "some.tza", FormatTza(archive, TensorType::kFloat));
    };
    write(data.path() / "relume/networks");
    ASSERT_TRUE(FindNetworkWeights("some"));
    EXPECT_EQ(FindNetworkWeights("some")->source,
              (data.path() / "relume/networks/some.tza").string());
    write(chosen.path());
    ASSERT_TRUE(FindNetworkWeights("some"));
    EXPECT_EQ(FindNetworkWeights("some")->source, (chosen.path() / "some.tza").string());
    EXPECT_EQ(FindNetworkWeights("some")->tensors.at("a.bias").values, archive.at("a.bias").values);
}

TEST(Oidn, WithoutItsWeightsSaysHowToGetThem) {
    const TemporaryFolder empty;
    const Variable networks("RELUME_NETWORKS", empty.path().string());
    const Variable xdg("XDG_DATA_HOME", empty.path().string());
    EXPECT_THAT(MessageOf([] { (void)MakeDenoiser("oidn"); }),
                AllOf(HasSubstr("rt_hdr_calb_cnrm.tza"), HasSubstr("deploy/fetch-oidn"),
                      HasSubstr(empty.path().string())));
}

TEST(Oidn, RefusesWhatIsNotPublished) {
    EXPECT_THAT(MessageOf([] { (void)MakeDenoiser("oidn:features=noisy,size=large"); }),
                HasSubstr("features=prefiltered"));
    EXPECT_THAT(MessageOf([] { (void)MakeDenoiser("oidn:size=huge"); }), HasSubstr("small"));
    EXPECT_THAT(MessageOf([] { (void)MakeDenoiser("oidn:features=some"); }), HasSubstr("noisy"));
}

bool HasOidn() { return FindNetworkWeights("rt_hdr_calb_cnrm").has_value(); }
constexpr const char* kWithoutOidn =
    "needs Open Image Denoise's weights: deploy/fetch-oidn, or RELUME_NETWORKS";

class OidnWeights : public testing::TestWithParam<const char*> {
  protected:
    void SetUp() override {
        if (!HasOidn()) {
            GTEST_SKIP() << kWithoutOidn;
        }
    }
    Result Filter(const Frame& frame) {
        Result result = RunDenoiser(*MakeDenoiser(GetParam()), frame, CancelToken{});
        for (const Plane& plane : result.color) {
            EXPECT_EQ(plane.size(), frame.pixel_count());
            for (const float value : plane) {
                EXPECT_TRUE(std::isfinite(value) && value >= 0) << value;
            }
        }
        return result;
    }
};

TEST_P(OidnWeights, LowersNoise) {
    const Truth truth{240, 140};
    const Frame frame = FrameFromFilm(MakeFilm(truth, 8, 1));
    // A checker of exponential noise, which it has never seen. Colour alone doesn't show the
    // albedo's edges.
    const bool blind = std::string_view(GetParam()).find("none") != std::string_view::npos;
    EXPECT_LT(MrSE(truth, Filter(frame).color, 0, 240),
              (blind ? 0.5 : 0.2) * MrSE(truth, frame.color, 0, 240));
}

TEST_P(OidnWeights, TakesAnySize) {
    for (const auto& [width, height] : {std::pair{1, 1}, {3, 7}, {1, 100}, {65, 33}, {0, 0}}) {
        (void)Filter(FrameFromFilm(MakeFilm(Truth{width, height}, 4, 2)));
    }
}

TEST_P(OidnWeights, KeepsBlackDark) {
    const Frame frame =
        FrameFromFilm(MakeFilm(Truth{64, 48}, 4, 1, [](int, int, int, PixelSample* sample) {
            sample->radiance = {0, 0, 0};
        }));
    const Result result = Filter(frame);
    for (const Plane& plane : result.color) {
        EXPECT_LT(*std::ranges::max_element(plane), 1e-3f);
    }
}

TEST_P(OidnWeights, WildSamplesLeaveItFiniteAndTheRestAlone) {
    const Truth truth{360, 60};
    const Result before = Filter(FrameFromFilm(MakeFilm(truth, 4, 5)));
    for (const float value : {NAN, INFINITY, 1e6f, 1e14f}) {
        const Result after = Filter(
            FrameFromFilm(MakeFilm(truth, 4, 5, [=](int x, int y, int index, PixelSample* sample) {
                if (x == 20 && y == 30 && index == 1) {
                    sample->radiance = {value, value, value};
                }
            })));
        // Beyond the receptive field only the exposure tells of it: a block of 92 is brighter,
        // which darkens what the network sees by 2^(-log2(1e14) / 92) = 0.7 at most.
        for (int y = 0; y < truth.height; ++y) {
            for (int x = 200; x < truth.width; ++x) {
                const auto i = static_cast<std::size_t>(y * truth.width + x);
                EXPECT_NEAR(after.color[0][i], before.color[0][i],
                            0.15f * before.color[0][i] + 0.01f)
                    << value << " at " << x << ", " << y;
            }
        }
    }
}

TEST_P(OidnWeights, BitsDoNotDependOnThreads) {
    const Frame frame = FrameFromFilm(MakeFilm(Truth{150, 90}, 4, 3));
    const int threads = ThreadCount();
    SetThreadCount(1);
    const Result one = Filter(frame);
    SetThreadCount(3);
    const Result three = Filter(frame);
    SetThreadCount(threads);
    for (int c = 0; c < 3; ++c) {
        EXPECT_TRUE(one.color[c] == three.color[c]);
    }
}

INSTANTIATE_TEST_SUITE_P(
    Filters, OidnWeights,
    testing::Values("oidn:features=prefiltered,size=base", "oidn:features=noisy,size=base",
                    "oidn:features=none,size=base", "oidn:features=prefiltered,size=small",
                    "oidn:features=noisy,size=small", "oidn:features=none,size=small",
                    "oidn:features=prefiltered,size=large"),
    [](const auto& param) {
        std::string name = param.param;
        std::erase_if(name, [](char c) { return std::isalnum(c) == 0; });
        return name;
    });

TEST(Oidn, TakesTheFeaturesThatThereAre) {
    if (!HasOidn()) {
        GTEST_SKIP() << kWithoutOidn;
    }
    Frame frame = FrameFromFilm(MakeFilm(Truth{40, 30}, 4, 3));
    const auto features = [&] {
        return RunDenoiser(*MakeDenoiser("oidn"), frame, CancelToken{}).notes.at("features");
    };
    EXPECT_EQ(features(), "prefiltered");
    frame.feature[kNormalX].clear();
    EXPECT_EQ(features(), "albedo, noisy");
    frame.feature[kAlbedoR].clear();
    EXPECT_EQ(features(), "none");
    EXPECT_EQ(MakeDenoiser("oidn")->Describe(), "oidn:features=prefiltered,size=base");
}

// What has no noise goes to the network as it is.
TEST(Oidn, CleanFeaturesAreNotFiltered) {
    if (!HasOidn()) {
        GTEST_SKIP() << kWithoutOidn;
    }
    const auto filter = [](bool noisy) {
        Frame frame = FrameFromFilm(MakeFilm(Truth{80, 60}, 4, 3));
        for (Plane& variance : frame.feature_variance) {
            variance.assign(frame.pixel_count(), 0.0f);
            variance[7] = noisy ? 0.01f : 0.0f;
        }
        return RunDenoiser(*MakeDenoiser("oidn"), frame, CancelToken{}).color[0];
    };
    EXPECT_FALSE(filter(false) == filter(true));
}

TEST_F(AuthorsRows, OidnIsTheirs) {
    if (!HasOidn()) {
        GTEST_SKIP() << kWithoutOidn;
    }
    const Image reference = Row("reference.exr");
    for (const auto& [filter, row] :
         {std::pair{"oidn:features=noisy", "oidn.exr"}, {"oidn", "oidn_prefilter_base.exr"}}) {
        const Image ours = Filter(filter), theirs = Row(row);
        const double of_theirs = MrSEOf(reference, theirs);
        EXPECT_LT(MrSEOf(reference, ours), 1.03 * of_theirs) << filter;
        EXPECT_LT(MrSEOf(theirs, ours), 0.03 * of_theirs) << filter;
    }
}

}  // namespace
}  // namespace relume::denoise
