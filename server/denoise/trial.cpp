#include "server/denoise/trial.h"

#include <algorithm>
#include <chrono>
#include <cmath>
#include <utility>

#include "core/image/metrics.h"
#include "server/denoise/error_estimate.h"
#include "server/denoise/frame_parts.h"
#include "server/denoise/halves.h"

namespace relume::denoise {
namespace {

constexpr int kShare = 16;              // one part in so many is judged
constexpr int kBlock = 16;              // pixels a side
constexpr double kLargestShare = 0.02;  // of blocks is cut off

double Seconds(std::chrono::steady_clock::time_point since) {
    return std::chrono::duration<double>(std::chrono::steady_clock::now() - since).count();
}

}  // namespace

Trial::Trial(const Frame& frame, const Denoiser& base, const CancelToken& cancel) {
    std::size_t part = 0;
    for (const TileRect& rect : ChooseWindows(frame, kShare)) {
        Window window{CutPart(frame, rect), {}, {}};
        part += window.part.frame.pixel_count();
        window.noise = VarianceByHalves(window.part.frame);
        windows_.push_back(std::move(window));
    }
    whole_over_part_ =
        part > 0 ? static_cast<double>(frame.pixel_count()) / static_cast<double>(part) : 1;
    const auto start = std::chrono::steady_clock::now();
    for (Window& window : windows_) {
        const FilteredHalves halves = FilterHalves(base, window.part.frame, cancel);
        window.scale = FilteredYardstick(halves);
        for (Plane& plane : window.scale) {
            for (float& v : plane) {
                v = 1 / (3 * (v + static_cast<float>(kRelMSEEpsilon)));
            }
        }
        AddBlocks(window, HalvesError(window.part.frame, halves, window.noise), &base_);
    }
    base_seconds_ = 0.5 * Seconds(start) * whole_over_part_;
    for (const Window& window : windows_) {
        AddBlocks(window, window.noise, &unfiltered_);
    }
    Errors sizes(base_);
    for (double& e : sizes) {
        e = std::abs(e);
    }
    if (!sizes.empty()) {
        const auto kept =
            sizes.begin() + static_cast<std::ptrdiff_t>((1 - kLargestShare) *
                                                        static_cast<double>(sizes.size() - 1));
        std::nth_element(sizes.begin(), kept, sizes.end());
        largest_ = *kept;
    }
}

void Trial::AddBlocks(const Window& window, const std::array<Plane, 3>& squared,
                      Errors* errors) const {
    const TileRect& r = window.part.inner;
    for (int y0 = r.y0; y0 < r.y1; y0 += kBlock) {
        for (int x0 = r.x0; x0 < r.x1; x0 += kBlock) {
            double sum = 0;
            int pixels = 0;
            for (int y = y0; y < std::min(y0 + kBlock, r.y1); ++y) {
                for (int x = x0; x < std::min(x0 + kBlock, r.x1); ++x, ++pixels) {
                    const auto i = static_cast<std::size_t>(y) *
                                       static_cast<std::size_t>(window.part.frame.width) +
                                   static_cast<std::size_t>(x);
                    for (std::size_t c = 0; c < 3; ++c) {
                        sum += squared[c][i] * window.scale[c][i];
                    }
                }
            }
            errors->push_back(sum / pixels);
        }
    }
}

Trial::Errors Trial::Judge(const Denoiser& denoiser, const CancelToken& cancel,
                           double* seconds) const {
    Errors errors;
    const auto start = std::chrono::steady_clock::now();
    for (const Window& window : windows_) {
        AddBlocks(window,
                  HalvesError(window.part.frame, FilterHalves(denoiser, window.part.frame, cancel),
                              window.noise),
                  &errors);
    }
    *seconds = 0.5 * Seconds(start) * whole_over_part_;
    return errors;
}

double Trial::Mean(const Errors& errors) const {
    double sum = 0;
    for (const double e : errors) {
        sum += std::clamp(e, -largest_, largest_);
    }
    return errors.empty() ? 0 : sum / static_cast<double>(errors.size());
}

Trial::Difference Trial::Compare(const Errors& a, const Errors& b) const {
    constexpr std::size_t kFewestBlocks = 8;  // that say something of their spread
    const auto n = static_cast<double>(a.size());
    double sum = 0, squares = 0;
    for (std::size_t i = 0; i < a.size(); ++i) {
        const double d =
            std::clamp(a[i], -largest_, largest_) - std::clamp(b[i], -largest_, largest_);
        sum += d;
        squares += d * d;
    }
    if (a.size() < kFewestBlocks) {
        return {a.empty() ? 0 : sum / n, 0};
    }
    const double mean = sum / n;
    return {mean, std::sqrt(std::max(0.0, squares / n - mean * mean) / (n - 1))};
}

}  // namespace relume::denoise
