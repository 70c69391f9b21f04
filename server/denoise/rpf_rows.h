#pragma once

#include <array>
#include <cstddef>
#include <span>
#include <vector>

#include "core/film/sample_records.h"
#include "server/denoise/frame.h"

namespace relume::denoise {

inline constexpr std::size_t kRpfHit = 9;  // numbers of a hit

// A sample's numbers as they are fetched: a cache line of what is looked at first, and one of the
// rest.
inline constexpr std::size_t kRpfRowFloats = 32;
struct alignas(64) RpfRow {
    std::array<float, kRpfRowFloats> values{};
};
// Where in a row what begins.
enum RpfRowPlace : std::size_t {
    kRpfRowHit = 0,     // the first hit: position, normal, albedo
    kRpfRowColor = 9,   // 3
    kRpfRowPlace = 12,  // 2: in the pixel
    kRpfRowSecond = 16,
    kRpfRowRandom = kRpfRowSecond + kRpfHit,  // 5
};

RpfRow RpfRowOf(const SampleRecord& record, const Rgb& color);

// The good samples of a frame, or of one half of it, pixel after pixel.
struct RpfSamples {
    int width = 0, height = 0;
    std::vector<std::size_t> first;            // of each pixel, and the end
    std::vector<const SampleRecord*> records;  // not owned
    // Of a row's numbers, whether they are not all the same.
    std::array<bool, kRpfRowFloats> varies{};
    float extent = 0;  // scene units: the diagonal of what is seen

    std::size_t Index(int x, int y) const {
        return static_cast<std::size_t>(y) * static_cast<std::size_t>(width) +
               static_cast<std::size_t>(x);
    }
    std::size_t CountOf(std::size_t pixel) const { return first[pixel + 1] - first[pixel]; }
};

RpfSamples RpfSamplesOf(const Frame& frame);

// The rows of a part of the frame, one after another: they are read over and over. Scratch of one
// thread.
class RpfRows {
  public:
    // Those of [x0, x1) x [y0, y1), with `colors` as the samples' colours.
    void Copy(const RpfSamples& samples, const std::vector<Rgb>& colors, int x0, int y0, int x1,
              int y1);

    std::span<const RpfRow> Of(int x, int y) const {
        const std::size_t pixel =
            static_cast<std::size_t>(y - y0_) * static_cast<std::size_t>(width_) +
            static_cast<std::size_t>(x - x0_);
        return {rows_.data() + first_[pixel], first_[pixel + 1] - first_[pixel]};
    }

  private:
    int x0_ = 0, y0_ = 0, width_ = 0;
    std::vector<std::size_t> first_;
    std::vector<RpfRow> rows_;
};

}  // namespace relume::denoise
