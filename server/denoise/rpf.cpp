// Random parameter filtering: Sen and Darabi 2012 (methods 2.5). Filters samples, not pixels, and
// so needs them all (Frame::samples).
//
//     neighbours=2048     of a pixel in a pass, at most; 0: as many as the paper draws (at 8
//                         samples a pixel 12100, 4900, 1156, 196): 2.3 times the time, no better
//     variance=0.02       of colours and features at 8 samples a pixel, in units of their own
//                         variance; the paper takes 0.02 for noisy interiors, 0.002 else; up to 100
//
// Four passes in boxes of 55, 35, 17 and 7 pixels. In each a pixel draws box^2/2 neighbours for
// each of its samples, by a Gaussian of box/4, and leaves out those whose first hit is unlike its
// own ones'. Among them, the mutual information of colours, features, the random numbers that the
// samples were drawn with and their place in the image says how far a colour's spread is noise: the
// more a colour depends on random numbers, the less it counts when its samples are compared, and
// features likewise. Then each of the pixel's samples becomes the weighted mean of all. A colour
// counts for nothing once half of what it depends on is random: alpha = 1 - 2 (1 + 0.1 t) W.
// Without that 2, chance, which feigns some dependence of everything on everything, makes colours
// count so much that most of the noise stays.
//
// What differs from the paper: positions are compared in units of the frame's extent, where the
// authors' 0.1 is one of theirs; Gaussian offsets are rounded, and those that meet the pixel itself
// are left out, since it is in already. The random numbers are those of lens, time and light; a
// pinhole's are those of the first direction. What hangs on it otherwise is told by the second
// hit's features.
//
// Estimated error: the squared difference to the unfiltered pixel less the variance of that. The
// pixel's own noise that is left, a small part, is not in it.
//
// Limits: neighbours are read from a copy of what lies about 16x16 pixels, 0.6 MB a thread for each
// sample a pixel; with neighbours=0 time rises with the square of the samples. A sample that is
// brighter than anything about it (a firefly) is spread over its pixel alone.
#include "server/denoise/rpf.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>

#include "core/base/error.h"
#include "server/denoise/rpf_information.h"
#include "server/denoise/rpf_pass.h"

namespace relume::denoise {
namespace {

constexpr std::array<int, 4> kBoxes = {55, 35, 17, 7};
constexpr float kNear = 0.1f;    // of a normal or an albedo: differences that never matter
constexpr float kUnit = 0.01f;   // of the frame's extent: the same for positions
constexpr float kFloor = 1e-4f;  // features that deviate by less are constant but for rounding

// What of the samples is looked at.
void ChooseColumns(const Frame& frame, const RpfSamples& samples, RpfPass* pass) {
    const float length = kUnit * samples.extent;
    const float unit =
        std::isfinite(length) && length > 0 ? length : std::numeric_limits<float>::max();
    const bool use[] = {!frame.feature[kDepth].empty(), !frame.feature[kNormalX].empty(),
                        !frame.feature[kAlbedoR].empty()};
    const auto add = [&](std::size_t column, std::size_t from, float floor) {
        if (samples.varies[from]) {
            pass->sources.push_back({column, from, floor});
        }
    };
    for (std::size_t c = 0; c < 3; ++c) {
        pass->sources.push_back({kRpfColor + c, kRpfRowColor + c, 0});
    }
    for (std::size_t f = 0; f < kRpfHit; ++f) {
        const bool position = f < 3;
        pass->near[f] = std::numeric_limits<float>::infinity();
        if (use[f / 3]) {
            pass->near[f] = position ? unit : kNear;
            const float floor = position ? kFloor * (unit / kNear) : kFloor;
            add(kRpfFeature + f, kRpfRowHit + f, floor);
            add(kRpfFeature + kRpfHit + f, kRpfRowSecond + f, floor);
        }
    }
    for (std::size_t r = 0; r < kRpfScreen - kRpfRandom; ++r) {
        add(kRpfRandom + r, kRpfRowRandom + r, 0);
    }
}

class Rpf final : public Denoiser {
  public:
    Rpf(int neighbours, float variance, const RpfKernels& kernels)
        : neighbours_(neighbours), variance_(variance), kernels_(kernels) {}

    std::string Describe() const override {
        return fmt::format("rpf:neighbours={},variance={}", neighbours_, variance_);
    }

    Needs GetNeeds() const override { return {.samples = true, .min_spp = 2}; }

    Result Reconstruct(const Frame& frame, const CancelToken& cancel) const override {
        Result result;
        if (frame.samples->pixel_count() != frame.pixel_count()) {
            ThrowInvalidArgument("filter 'rpf': the samples are of another image");
        }
        Filter(frame, RpfSamplesOf(frame), cancel, result.color);
        result.error.emplace(frame.pixel_count());
        for (std::size_t i = 0; i < frame.pixel_count(); ++i) {
            float sum = 0;
            for (int c = 0; c < 3; ++c) {
                const float d = result.color[c][i] - frame.color[c][i];
                sum += d * d - frame.variance[c][i];
            }
            (*result.error)[i] = sum * (1.0f / 3.0f);
        }
        return result;
    }

  private:
    // Means of the filtered samples; the frame's colour where a pixel has none.
    void Filter(const Frame& frame, const RpfSamples& samples, const CancelToken& cancel,
                Plane (&out)[3]) const {
        std::size_t most = 0;
        for (std::size_t i = 0; i < frame.pixel_count(); ++i) {
            most = std::max(most, samples.CountOf(i));
        }
        std::vector<Rgb> colors;
        colors.reserve(samples.records.size());
        for (const SampleRecord* record : samples.records) {
            colors.push_back(record->radiance);
        }
        RpfPass pass;
        pass.variance = variance_;
        if (neighbours_ > 0) {
            pass.most = static_cast<std::size_t>(neighbours_);
        }
        ChooseColumns(frame, samples, &pass);
        const auto terms = EntropyTerms(most + RpfNeighbours(pass, most));
        for (std::size_t t = 0; t < kBoxes.size(); ++t) {
            pass.number = static_cast<int>(t);
            pass.box = kBoxes[t];
            pass.spread_spikes = t + 1 < kBoxes.size();  // it changes no pixel's mean
            colors = FilterSamples(samples, colors, pass, terms, kernels_, cancel);
        }
        for (std::size_t c = 0; c < 3; ++c) {
            out[c] = frame.color[c];
            for (std::size_t i = 0; i < frame.pixel_count(); ++i) {
                double sum = 0;
                for (std::size_t k = samples.first[i]; k < samples.first[i + 1]; ++k) {
                    sum += colors[k][static_cast<int>(c)];
                }
                if (samples.CountOf(i) > 0) {
                    out[c][i] = static_cast<float>(sum / static_cast<double>(samples.CountOf(i)));
                }
            }
        }
    }

    int neighbours_;
    float variance_;
    const RpfKernels& kernels_;
};

}  // namespace

std::unique_ptr<Denoiser> MakeRpf(const ParamSet& params, const RpfKernels& kernels) {
    const int neighbours = params.GetInt("neighbours", 2048);
    if (neighbours < 0 || static_cast<std::size_t>(neighbours) > kMostRpfNeighbours) {
        ThrowInvalidArgument(
            fmt::format("neighbours={}: must be 0 to {}", neighbours, kMostRpfNeighbours));
    }
    const float variance = params.GetFloat("variance", 0.02f);
    if (!(variance > 0 && variance <= 100)) {
        ThrowInvalidArgument(fmt::format("variance={}: must be above 0, at most 100", variance));
    }
    return std::make_unique<Rpf>(neighbours, variance, kernels);
}

std::unique_ptr<Denoiser> MakeRpf(const ParamSet& params) { return MakeRpf(params, BestRpf()); }

}  // namespace relume::denoise
