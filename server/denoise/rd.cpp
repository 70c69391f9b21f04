// Robust denoising by features and colour: Rousselle, Manzi, Zwicker 2013 (methods 2.6).
//
//   radius   of the window, pixels (default 10, the paper's; 1 to 20). The time grows with its
//            square; with 5 it takes 0.42 of that with 10, and `net` mixes it so: of what it gains
//            there 9/10 are left (docs/adr/2026-11-27-a-smaller-window.md)
//
// A pixel becomes the weighted mean of its window, 21x21 pixels if not told otherwise. A
// neighbour's weight is the least of those by colour (patch distances, nlm_weights.h, k = 0.45) and
// by each feature (prefiltered, feature_prefilter.h; k = 0.6), so that any of them can keep an
// edge; the pairwise symmetric trick is on. Three candidates:
//   fine     patches of 3x3 pixels, least spread of a feature 1e-3
//   smooth   patches of 7x7 pixels, 1e-3
//   features no colour, 1e-4
// Each has its SURE, with the derivative by filtering again with the pixel's own value 1 % larger
// in all channels, as their noise goes together. SURE is smoothed over 3x3 by colour (k = 1, patch
// 7x7), each pixel takes the candidate of least SURE (fine: only where its derivative is not above
// that of smooth), and the choice is smoothed over 11x11. What comes out is filtered once more, as
// smooth but over 11x11 with 1e-4, by the variance that the halves, filtered alike, show to be
// left.
//
// Features: normal, albedo, depth (the paper has the position), visibility; those that the frame
// lacks are left out, and so is the paper's caustic buffer. Without halves (or of a half) the
// variance that is left is what the weights leave of the frame's.
//
// Estimated error: the chosen candidates' smoothed SURE, before the last filtering.
//
// Planner: max(0, SURE) of fine, over F^2 + 1e-2 and its filtered count, smoothed over 21x21 by
// colour.
//
// Limits: SURE is for Gaussian noise; where a few bright samples make the noise, some of their
// energy is lost.
#include "server/denoise/rd.h"

#include <fmt/format.h>

#include <algorithm>
#include <utility>

#include "core/base/error.h"
#include "server/denoise/crop_frame.h"
#include "server/denoise/nlm_filter.h"
#include "server/denoise/rd_frame.h"
#include "server/denoise/share_samples.h"

namespace relume::denoise {
namespace {

constexpr double kMostOfMean = 8;  // samples of a pixel in a plan, as nlm
constexpr int kMostRadius = 20;

// Those planes of a part of a frame that FilterRdFrame reads.
Frame Crop(const Frame& frame, const TileRect& rect) {
    Frame out;
    out.width = rect.width();
    out.height = rect.height();
    for (int c = 0; c < 3; ++c) {
        out.color[c] = CropPlane(frame.color[c], frame.width, rect);
        out.variance[c] = CropPlane(frame.variance[c], frame.width, rect);
        for (int h = 0; h < 2; ++h) {
            out.half[h][c] = CropPlane(frame.half[h][c], frame.width, rect);
        }
    }
    out.count = CropPlane(frame.count, frame.width, rect);
    return out;
}

RdFeaturePlanes Crop(const RdFeaturePlanes& features, int width, const TileRect& rect) {
    RdFeaturePlanes out;
    out.group_size = features.group_size;
    for (std::size_t c = 0; c < features.value.size(); ++c) {
        out.value.push_back(CropPlane(features.value[c], width, rect));
        out.variance.push_back(CropPlane(features.variance[c], width, rect));
        out.spread.push_back(CropPlane(features.spread[c], width, rect));
    }
    return out;
}

double SumOf(const Plane& plane, std::size_t first, std::size_t count) {
    double sum = 0;
    for (std::size_t i = first; i < first + count; ++i) {
        sum += plane[i];
    }
    return sum;
}

class Rd final : public Denoiser {
  public:
    Rd(const NlmKernels& kernels, std::size_t band_pixels, int radius)
        : kernels_(kernels), band_pixels_(band_pixels), radius_(radius) {}

    std::string Describe() const override {
        return radius_ == kRdRadius ? "rd" : fmt::format("rd:radius={}", radius_);
    }

    Result Reconstruct(const Frame& frame, const CancelToken& cancel) const override {
        const RdFeaturePlanes features =
            MakeRdFeatures(frame, PrefilterFeatures(frame, cancel, kernels_));
        const auto width = static_cast<std::size_t>(frame.width);
        Result result;
        result.error.emplace(frame.pixel_count());
        for (Plane& plane : result.color) {
            plane.resize(frame.pixel_count());
        }
        double share[kRdCandidates] = {};
        const int rows =
            std::max(1, static_cast<int>(band_pixels_ / std::max<std::size_t>(width, 1)));
        for (int from = 0; from < frame.height; from += rows) {
            const int to = std::min(from + rows, frame.height);
            const int begin = std::max(from - RdReach(radius_), 0);
            const int end = std::min(to + RdReach(radius_), frame.height);
            const TileRect rect = {0, begin, frame.width, end};
            const bool whole = end - begin == frame.height;
            const RdFrame band =
                whole ? FilterRdFrame(frame, features, radius_, kernels_, cancel)
                      : FilterRdFrame(Crop(frame, rect), Crop(features, frame.width, rect), radius_,
                                      kernels_, cancel);
            const std::size_t skipped = static_cast<std::size_t>(from - begin) * width;
            const std::size_t count = static_cast<std::size_t>(to - from) * width;
            const std::size_t first = static_cast<std::size_t>(from) * width;
            const auto copy = [&](const Plane& plane, Plane* all) {
                std::copy_n(plane.begin() + static_cast<std::ptrdiff_t>(skipped), count,
                            all->begin() + static_cast<std::ptrdiff_t>(first));
            };
            for (std::size_t c = 0; c < 3; ++c) {
                copy(band.color[c], &result.color[c]);
            }
            copy(band.error, &*result.error);
            for (std::size_t k = 0; k < kRdCandidates; ++k) {
                share[k] += SumOf(band.share[k], skipped, count);
            }
        }
        const double percent =
            100 / static_cast<double>(std::max<std::size_t>(frame.pixel_count(), 1));
        result.notes["features"] = features.names.empty() ? "none" : features.names;
        result.notes["candidates"] =
            fmt::format("fine {:.1f} %, smooth {:.1f} %, features {:.1f} %", percent * share[kFine],
                        percent * share[kSmooth], percent * share[kFeatures]);
        return result;
    }

    Plane PlanSamples(const Frame& frame, double samples,
                      const CancelToken& cancel) const override {
        const RdFeaturePlanes features =
            MakeRdFeatures(frame, PrefilterFeatures(frame, cancel, kernels_));
        const NlmGuide guide = ColorGuide(frame);
        Plane count = frame.count;
        count.resize(frame.pixel_count(), 1.0f);
        const RdScene scene{guide,   features,
                            radius_, true,
                            false,   {&frame.color[0], &frame.color[1], &frame.color[2], &count}};
        const RdFiltered fine =
            std::move(ApplyRdFilters(scene, {&kRdCandidateFilters[kFine], 1}, cancel, kernels_)[0]);
        Plane error(frame.pixel_count()), smooth;
        for (std::size_t i = 0; i < error.size(); ++i) {
            const float mean = (fine.out[0][i] + fine.out[1][i] + fine.out[2][i]) * (1.0f / 3.0f);
            error[i] = std::max(fine.sure[i], 0.0f) /
                       ((1e-2f + mean * mean) * std::max(fine.out[3][i], 1.0f));
        }
        FilterNlm(guide, kRdSmoothing, kRdRadius, std::vector<const Plane*>{&error},
                  std::vector{&smooth}, cancel, kernels_);
        return ShareSamples(smooth, samples, 0,
                            kMostOfMean * samples / static_cast<double>(error.size()));
    }

  private:
    const NlmKernels& kernels_;
    std::size_t band_pixels_;
    int radius_;
};

}  // namespace

std::unique_ptr<Denoiser> MakeRd(const NlmKernels& kernels, std::size_t band_pixels, int radius) {
    return std::make_unique<Rd>(kernels, band_pixels, radius);
}

std::unique_ptr<Denoiser> MakeRd(const ParamSet& params) {
    const int radius = params.GetInt("radius", kRdRadius);
    if (radius < 1 || radius > kMostRadius) {
        ThrowInvalidArgument(
            fmt::format("filter 'rd': radius={} must be 1 to {}", radius, kMostRadius));
    }
    return MakeRd(BestNlmKernels(), kRdBandPixels, radius);
}

}  // namespace relume::denoise
