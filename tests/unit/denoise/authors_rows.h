#pragma once

#include <gtest/gtest.h>

#include <algorithm>
#include <filesystem>

#include "core/image/exr.h"
#include "core/image/metrics.h"
#include "server/denoise/denoiser.h"
#include "server/denoise/output_image.h"

namespace relume::denoise {

// The frame of ../shared/buffers/chess, and others' results on it.
class AuthorsRows : public testing::Test {
  protected:
    void SetUp() override {
        if (!std::filesystem::exists(kFolder / "buffers.exr")) {
            GTEST_SKIP() << "needs ../shared/buffers/chess";
        }
        Image buffers = ReadExr(kFolder / "buffers.exr");
        std::ranges::fill(buffers.Plane(buffers.Add("samples.Y")), 8.0f);
        frame_ = FrameFromImage(buffers, nullptr);
    }

    static double MrSEOf(const Image& reference, const Image& test) {
        return CompareImages(reference, test, "", "", false).mrse;
    }
    static Image Row(const char* name) { return ReadExr(kFolder / name); }
    Image Filter(const char* filter) const {
        const Result result = RunDenoiser(*MakeDenoiser(filter), frame_, CancelToken{});
        return AssembleLayers(frame_, result, nullptr, false);
    }

    inline static const std::filesystem::path kFolder =
        std::filesystem::path(RELUME_SOURCE_DIR) / "../shared/buffers/chess";
    Frame frame_;
};

}  // namespace relume::denoise
