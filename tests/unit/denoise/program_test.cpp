// relume-denoise as its users see it: files, lines and exit codes.
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <sys/wait.h>

#include <cstdio>
#include <cstdlib>

#include "core/base/files.h"
#include "core/image/exr.h"
#include "server/denoise/output_image.h"
#include "tests/unit/denoise/synthetic.h"

namespace relume::denoise {
namespace {

using testing::HasSubstr;

class DenoiseProgram : public testing::Test {
  protected:
    DenoiseProgram() {
        const Film film = MakeFilm({2, 1, 62, 41}, 70, 50, Truth{60, 40}, 8, 1);
        const Frame frame = FrameFromFilm(film);
        const Result result = RunDenoiser(*MakeDenoiser("none"), frame, CancelToken{});
        const ErrorEstimate error = EstimateNoisy(frame);
        image_ = AssembleOutput(film, frame, result, &error, true);
        image_.metadata()["relume.seed"] = "5";
        WriteExr(input_, image_);
    }

    // Runs the program; its output, stdout and stderr together, is in output_ then.
    int Run(const std::string& arguments) {
        const std::string command = RELUME_BINARY_DIR "/relume-denoise " + arguments + " 2>&1";
        FILE* pipe = popen(command.c_str(), "r");
        printed_.clear();
        for (int c = fgetc(pipe); c != EOF; c = fgetc(pipe)) {
            printed_ += static_cast<char>(c);
        }
        const int status = pclose(pipe);
        return WIFEXITED(status) ? WEXITSTATUS(status) : -1;
    }
    bool Wrote() const { return std::filesystem::exists(output_); }

    TemporaryFolder folder_;
    std::string input_ = folder_.path() / "in.exr", output_ = folder_.path() / "out.exr", printed_;
    Image image_;
};

TEST_F(DenoiseProgram, FiltersAFile) {
    ASSERT_EQ(Run(input_ + " -o " + output_ + " --filter bilateral --threads 2"), 0) << printed_;
    const Image out = ReadExr(output_);
    EXPECT_EQ(out.x0(), 2);
    EXPECT_EQ(out.y0(), 1);
    EXPECT_EQ(out.display_width(), 70);
    EXPECT_EQ(out.metadata().at("relume.seed"), "5");
    EXPECT_EQ(out.metadata().at("relume.filter"), "bilateral:mode=robust");
    EXPECT_FALSE(out.Has("buffer_a.R"));
    const std::span<const float> noisy = out.Plane("noisy.R"), filtered = out.Plane("R"),
                                 was = image_.Plane("R");
    EXPECT_TRUE(std::ranges::equal(noisy, was));
    EXPECT_FALSE(std::ranges::equal(filtered, noisy));
}

TEST_F(DenoiseProgram, AllLayersMayBeFilteredAgain) {
    ASSERT_EQ(Run(input_ + " -o " + output_ + " --layers all --filter bilateral:mode=printed"), 0);
    EXPECT_TRUE(ReadExr(output_).Has("N_variance.Z"));
    ASSERT_EQ(Run(output_ + " -o " + output_ + " --layers all --filter none"), 0);
    EXPECT_TRUE(std::ranges::equal(ReadExr(output_).Plane("R"), image_.Plane("noisy.R")));
}

TEST_F(DenoiseProgram, KeepsAlphaAndSaysWhatIsMissing) {
    Image plain(20, 10, {"R", "G", "B", "A"});
    std::ranges::fill(plain.Plane("A"), 0.5f);
    WriteExr(input_, plain);
    ASSERT_EQ(Run(input_ + " -o " + output_), 0) << printed_;
    EXPECT_THAT(printed_, HasSubstr(input_ + ": variance: none in the file"));
    EXPECT_THAT(printed_, HasSubstr(input_ + ": normal: none in the file"));
    EXPECT_EQ(ReadExr(output_).Plane("A")[7], 0.5f);
}

TEST_F(DenoiseProgram, FailsInOneLineThatNamesTheFile) {
    WriteExr(folder_.path() / "depth.exr", Image(4, 4, {"Z"}));
    WriteFileAtomically(folder_.path() / "cut.exr", ReadFile(input_).substr(0, 900));
    for (const char* name : {"missing.exr", "depth.exr", "cut.exr"}) {
        const std::string path = folder_.path() / name;
        EXPECT_EQ(Run(path + " -o " + output_), 3) << name;
        EXPECT_THAT(printed_, HasSubstr(path));
        EXPECT_EQ(std::ranges::count(printed_, '\n'), 1) << printed_;
        EXPECT_FALSE(Wrote());
    }
    EXPECT_EQ(Run(input_ + " -o /nonexistent/out.exr"), 6);
    EXPECT_THAT(printed_, HasSubstr("/nonexistent/out.exr"));
    EXPECT_EQ(Run(input_ + " -o " + output_ + " --filter bilatral"), 2);
    EXPECT_THAT(printed_, HasSubstr("known: auto, none, bilateral"));
    EXPECT_FALSE(Wrote());
}

TEST_F(DenoiseProgram, UsageIsTwo) {
    EXPECT_EQ(Run(""), 2);
    EXPECT_EQ(Run(input_), 2);
    EXPECT_EQ(Run(input_ + " -o " + output_ + " --layers some"), 2);
    EXPECT_EQ(Run(input_ + " -o " + output_ + " --threads -1"), 2);
    EXPECT_EQ(Run("--no-such-option"), 2);
    EXPECT_FALSE(Wrote());
}

TEST_F(DenoiseProgram, DescribesItsFilters) {
    EXPECT_EQ(Run("--describe"), 0);
    EXPECT_EQ(printed_, DescribeDenoisers());
}

}  // namespace
}  // namespace relume::denoise
