// Random parameter filtering: Sen and Darabi 2012 (methods 2.5). Filters samples, not pixels, and
// so needs them all (Frame::samples).
//
//     neighbours=all      all: as many as the paper draws; few: 0.02, 0.04, 0.3 and 0.5 of them in
//                         the four passes: some 20 times faster, but what so few samples tell of
//                         dependences is mostly chance, and noise stays
//     variance=0.02       of colours and features at 8 samples a pixel, in units of their own
//                         variance; the paper takes 0.02 for noisy interiors, 0.002 else; up to 100
//
// Four passes in boxes of 55, 35, 17 and 7 pixels. In each a pixel draws box^2/2 neighbours for
// each of its samples, by a Gaussian of box/4, and leaves out those whose first hit is unlike its
// own ones'. Among them, the mutual information of colours, features, the random numbers that the
// samples were drawn with and their place in the image says how far a colour's spread is noise: the
// more a colour depends on random numbers, the less it counts when its samples are compared, and
// features likewise. Then each of the pixel's samples becomes the weighted mean of all.
//
// What differs from the paper: positions are compared in units of the frame's extent, where the
// authors' 0.1 is one of theirs; Gaussian offsets are rounded, and those that meet the pixel itself
// are left out, since it is in already; at most 131072 neighbours. The random numbers are those of
// lens, time and light; a pinhole's are those of the first direction. What hangs on it otherwise is
// told by the second hit's features.
//
// Estimated error: the squared difference to the unfiltered pixel less the variance of that. The
// pixel's own noise that is left, a small part, is not in it.
//
// Limits: time and memory rise with the square of the samples a pixel. A sample that is brighter
// than anything about it (a firefly) is spread over its pixel alone.
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
constexpr std::array<double, 4> kFew = {0.02, 0.04, 0.3, 0.5};

bool IsGood(const SampleRecord& record) {
    bool finite = !record.bad() && std::isfinite(record.x) && std::isfinite(record.y);
    for (const auto& hit : record.hits) {
        finite = finite && IsFinite(hit.position) && IsFinite(hit.normal) && IsFinite(hit.albedo);
    }
    return finite && std::ranges::all_of(record.random, [](float u) { return std::isfinite(u); });
}

RpfSamples Collect(const Frame& frame) {
    RpfSamples out;
    out.width = frame.width;
    out.height = frame.height;
    out.use_position = !frame.feature[kDepth].empty();
    out.use_normal = !frame.feature[kNormalX].empty();
    out.use_albedo = !frame.feature[kAlbedoR].empty();
    Vec3f low{1e30f, 1e30f, 1e30f}, high{-1e30f, -1e30f, -1e30f};
    out.first.push_back(0);
    for (std::size_t i = 0; i < frame.pixel_count(); ++i) {
        for (const SampleRecord& record : frame.samples->Of(i)) {
            if (IsGood(record)) {
                out.records.push_back(&record);
                low = Min(low, record.hits[0].position);
                high = Max(high, record.hits[0].position);
            }
        }
        out.first.push_back(out.records.size());
    }
    const float extent = out.records.empty() ? 0 : Length(high - low);
    out.position_unit =
        std::isfinite(extent) && extent > 0 ? 0.01f * extent : std::numeric_limits<float>::max();
    return out;
}

class Rpf final : public Denoiser {
  public:
    Rpf(bool few, float variance, RpfKernel kernel)
        : few_(few), variance_(variance), kernel_(kernel) {}

    std::string Describe() const override {
        return fmt::format("rpf:neighbours={},variance={}", few_ ? "few" : "all", variance_);
    }

    Needs GetNeeds() const override { return {.samples = true, .min_spp = 2}; }

    Result Reconstruct(const Frame& frame, const CancelToken& cancel) const override {
        Result result;
        if (frame.samples->pixel_count() != frame.pixel_count()) {
            ThrowInvalidArgument("filter 'rpf': the samples are of another image");
        }
        Filter(frame, Collect(frame), cancel, result.color);
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
        const auto terms = EntropyTerms(most + RpfNeighbours(pass, most));
        for (std::size_t t = 0; t < kBoxes.size(); ++t) {
            pass.number = static_cast<int>(t);
            pass.box = kBoxes[t];
            pass.neighbours = few_ ? kFew[t] : 1;
            pass.spread_spikes = t + 1 < kBoxes.size();  // it changes no pixel's mean
            colors = FilterSamples(samples, colors, pass, terms, kernel_, cancel);
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

    bool few_;
    float variance_;
    RpfKernel kernel_;
};

}  // namespace

std::unique_ptr<Denoiser> MakeRpf(const ParamSet& params, RpfKernel kernel) {
    const bool few = params.GetChoice("neighbours", "all", {"all", "few"}) == "few";
    const float variance = params.GetFloat("variance", 0.02f);
    if (!(variance > 0 && variance <= 100)) {
        ThrowInvalidArgument(fmt::format("variance={}: must be above 0, at most 100", variance));
    }
    return std::make_unique<Rpf>(few, variance, kernel);
}

std::unique_ptr<Denoiser> MakeRpf(const ParamSet& params) { return MakeRpf(params, BestRpf()); }

}  // namespace relume::denoise
