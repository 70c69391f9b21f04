#pragma once

#include <cstdint>
#include <memory>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "core/film/aov.h"
#include "core/film/moments.h"
#include "core/film/sample_records.h"
#include "core/film/tile.h"

namespace relume {

// The per-pixel state of one frame: kFilmChannelCount float planes over `window`, 160 bytes a
// pixel. Not thread-safe.
class Film {
  public:
    Film(const TileRect& window, int display_width, int display_height);

    const TileRect& window() const { return window_; }
    int width() const { return window_.width(); }
    int height() const { return window_.height(); }
    int display_width() const { return display_width_; }
    int display_height() const { return display_height_; }
    std::size_t pixel_count() const { return window_.area(); }

    // Row-major over the window.
    std::span<const float> Plane(int channel) const {
        return {data_.data() + static_cast<std::size_t>(channel) * pixel_count(), pixel_count()};
    }

    // Folds a result in. Each of its pixels must hold the samples that follow those already merged
    // there; whoever calls sees to that order (server/jobs), which makes the film's bits
    // independent of the order of arrival. Throws kInvalidArgument if the result does not lie in
    // the window or its sizes disagree; the film is unchanged then.
    void Merge(const TileResult& result);

    // All that there is of the pixels of `rect`, which lies in the window, as it lies in memory.
    std::string SaveTile(const TileRect& rect) const;
    // Puts back what SaveTile told of the same pixels, into a film that has no samples there.
    // Throws kDataLoss if the sizes disagree.
    void LoadTile(const TileRect& rect, std::string_view bytes);

    // The samples themselves, if the results merged so far had them; else null. It grows with the
    // film.
    std::shared_ptr<const SampleRecords> samples() const { return samples_; }

    // Index of the next sample of pixel i: samples merged, bad ones included.
    std::uint32_t NextIndex(std::size_t i) const;
    // Finite samples in both halves.
    float SampleCount(std::size_t i) const { return Plane(kCountA)[i] + Plane(kCountB)[i]; }

    // Mean radiance of all samples; black where there are none.
    Rgb Mean(std::size_t i) const;
    // Variance of that mean per channel, from the sample variances of the halves: each half's
    // MeanVariance weighted by (n_h/n)^2. Zero below two samples a half.
    Rgb MeanVariance(std::size_t i) const;
    // The same from the difference of the halves, (A-B)^2 n_a n_b / n^2: one degree of freedom, but
    // right for low-discrepancy samples. Zero if a half is empty.
    Rgb HalfVariance(std::size_t i) const;
    // Mean over the RGB of variance of the mean / (mean^2 + 0.01), by HalfVariance: RelMSE of the
    // unfiltered pixel, estimated without a reference. Averaged over pixels: of the image.
    double EstimateRelMSE(std::size_t i) const;
    double EstimateRelMSE() const;
    double TotalSamples() const;
    double TotalBadSamples() const;

  private:
    // Of pixel k of a result, in the window.
    std::size_t IndexOf(const TileResult& result, std::size_t k) const;
    void MergeSamples(const TileResult& result);
    // body(index of the first pixel, pixels) for each row of `rect`.
    template <typename F>
    void ForEachRow(const TileRect& rect, F&& body) const;

    TileRect window_;
    int display_width_, display_height_;
    std::vector<float> data_;
    std::shared_ptr<SampleRecords> samples_;
};

}  // namespace relume
