// The light that a filter lost, given back.
#include "server/denoise/restore_energy.h"

#include <gtest/gtest.h>

#include "tests/unit/denoise/synthetic.h"

namespace relume::denoise {
namespace {

double LightOf(const Plane (&image)[3]) {
    double sum = 0;
    for (const Plane& plane : image) {
        for (const float value : plane) {
            sum += value;
        }
    }
    return sum;
}

// Makes every pixel `factor` times as bright.
class Dimmer final : public Denoiser {
  public:
    explicit Dimmer(float factor) : factor_(factor) {}
    std::string Describe() const override { return "dimmer"; }
    Result Reconstruct(const Frame& frame, const CancelToken&) const override {
        Result result;
        result.error.emplace(frame.pixel_count(), 1.0f);
        for (std::size_t c = 0; c < 3; ++c) {
            result.color[c] = frame.color[c];
            for (float& value : result.color[c]) {
                value *= factor_;
            }
        }
        return result;
    }

  private:
    float factor_;
};

Result Restore(float factor, const Frame& frame) {
    return RunDenoiser(*RestoreEnergy(std::make_unique<Dimmer>(factor)), frame, CancelToken());
}

TEST(RestoreEnergy, GivesBackWhatIsLost) {
    const Frame frame = FrameFromFilm(MakeFilm({120, 80}, 8, 3));
    for (const float factor : {0.92f, 0.95f, 0.985f, 1.1f}) {
        const Result result = Restore(factor, frame);
        EXPECT_NEAR(LightOf(result.color) / LightOf(frame.color), 1, 1e-3) << factor;
        const float gain = result.color[1][7] / (factor * frame.color[1][7]);
        EXPECT_NE(gain, 1);
        EXPECT_NEAR((*result.error)[7], gain * gain, 1e-4);
    }
}

TEST(RestoreEnergy, BrightPixelsGetTheirSquareAndNoneMoreThanAFifth) {
    Frame frame = FrameFromFilm(MakeFilm({120, 80}, 8, 3));
    const auto set = [&](std::size_t i, float light) {
        for (std::size_t c = 0; c < 3; ++c) {
            frame.color[c][i] = light;
            frame.variance[c][i] = 1e-4f;
        }
    };
    for (std::size_t i = 0; i < frame.pixel_count(); ++i) {
        set(i, i % 2 == 0 ? 1.0f : 0.25f);
    }
    set(1000, 20);
    const Result result = Restore(0.95f, frame);
    const auto gain = [&](std::size_t i) {
        return result.color[0][i] / (0.95f * frame.color[0][i]) - 1;
    };
    EXPECT_NEAR(gain(1000), 0.2, 1e-5);
    EXPECT_NEAR(gain(2) / gain(3), 4, 0.01);
    EXPECT_NEAR(LightOf(result.color) / LightOf(frame.color), 1, 1e-3);
}

TEST(RestoreEnergy, AtMostASeventh) {
    const Frame frame = FrameFromFilm(MakeFilm({120, 80}, 8, 3));
    EXPECT_NEAR(LightOf(Restore(0.1f, frame).color) / LightOf(frame.color), 0.115, 1e-3);
}

TEST(RestoreEnergy, AFireflyMovesTheImageByThreePercent) {
    const auto hook = [](int x, int y, int index, PixelSample* sample) {
        if (y == 7 && x == 20 && index == 2) {
            sample->radiance = {1e5f, 1e5f, 1e5f};
            sample->indirect_luminance = 1e5f;
        }
    };
    const Frame clean = FrameFromFilm(MakeFilm({120, 80}, 8, 3));
    const Frame frame = FrameFromFilm(MakeFilm({120, 80}, 8, 3, hook));
    // A filter that keeps nothing of them.
    class Clean final : public Denoiser {
      public:
        explicit Clean(const Frame& frame) : frame_(frame) {}
        std::string Describe() const override { return "clean"; }
        Result Reconstruct(const Frame&, const CancelToken&) const override {
            Result result;
            for (std::size_t c = 0; c < 3; ++c) {
                result.color[c] = frame_.color[c];
            }
            return result;
        }

      private:
        const Frame& frame_;
    };
    const Result result =
        RunDenoiser(*RestoreEnergy(std::make_unique<Clean>(clean)), frame, CancelToken());
    EXPECT_NEAR(LightOf(result.color) / LightOf(clean.color), 1.03, 1e-3);
    EXPECT_EQ(result.notes.at("energy"), "+3.00 %");
}

}  // namespace
}  // namespace relume::denoise
