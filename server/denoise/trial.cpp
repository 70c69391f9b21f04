#include "server/denoise/trial.h"

#include <algorithm>
#include <chrono>
#include <cmath>
#include <cstdint>

#include "core/base/check.h"
#include "core/image/metrics.h"
#include "server/denoise/crop_frame.h"
#include "server/denoise/error_estimate.h"
#include "server/denoise/halves.h"

namespace relume::denoise {
namespace {

constexpr int kInner = 64, kHalo = 24, kBlock = 16;  // pixels a side; halo on each side
constexpr int kPart = 8;                             // one part in so many is judged
constexpr std::size_t kSmall = 192 * 192;            // pixels: all of such a frame is
constexpr double kLargestShare = 0.02;               // of blocks is cut off

double Seconds(std::chrono::steady_clock::time_point since) {
    return std::chrono::duration<double>(std::chrono::steady_clock::now() - since).count();
}

std::uint32_t Hash(std::uint32_t v) {
    v = v * 747796405u + 2891336453u;
    v = ((v >> ((v >> 28) + 4)) ^ v) * 277803737u;
    return (v >> 22) ^ v;
}

// The parts that are judged, without their halos: one at a random place of each cell of a grid.
std::vector<TileRect> ChooseWindows(int width, int height) {
    const std::size_t pixels = static_cast<std::size_t>(width) * static_cast<std::size_t>(height);
    if (pixels <= kSmall || width < kInner || height < kInner) {
        return {{0, 0, width, height}};
    }
    const double cells =
        std::max(8.0, static_cast<double>(pixels) /
                          (kPart * double{kInner + 2 * kHalo} * (kInner + 2 * kHalo)));
    const double aspect = static_cast<double>(width) / height;
    const int across =
        std::clamp(static_cast<int>(std::lround(std::sqrt(cells * aspect))), 1, width / kInner);
    const int down = std::clamp(static_cast<int>(std::lround(cells / across)), 1, height / kInner);
    std::vector<TileRect> windows;
    const auto place = [](int cell, int cells_of, int size, std::uint32_t random) {
        const int begin = static_cast<int>(std::int64_t{size} * cell / cells_of);
        const int end = static_cast<int>(std::int64_t{size} * (cell + 1) / cells_of);
        return begin +
               static_cast<int>(random % static_cast<std::uint32_t>(end - begin - kInner + 1));
    };
    for (int v = 0; v < down; ++v) {
        for (int u = 0; u < across; ++u) {
            const std::uint32_t random = Hash(static_cast<std::uint32_t>(v * across + u));
            const int x = place(u, across, width, random), y = place(v, down, height, Hash(random));
            windows.push_back({x, y, x + kInner, y + kInner});
        }
    }
    return windows;
}

FilteredHalves Halves(const Denoiser& denoiser, const Frame& frame, const CancelToken& cancel) {
    if (!denoiser.GetNeeds().halves) {
        return FilterHalves(denoiser, frame, cancel);
    }
    Result result = RunDenoiser(denoiser, frame, cancel);
    RELUME_CHECK(result.halves);
    return std::move(*result.halves);
}

}  // namespace

Trial::Trial(const Frame& frame, const Denoiser& base, const CancelToken& cancel) {
    std::size_t part = 0;
    for (const TileRect& inner : ChooseWindows(frame.width, frame.height)) {
        const TileRect outer = {std::max(inner.x0 - kHalo, 0), std::max(inner.y0 - kHalo, 0),
                                std::min(inner.x1 + kHalo, frame.width),
                                std::min(inner.y1 + kHalo, frame.height)};
        Window window;
        window.frame = CropFrame(frame, outer);
        window.inner = {inner.x0 - outer.x0, inner.y0 - outer.y0, inner.x1 - outer.x0,
                        inner.y1 - outer.y0};
        window.noise = VarianceByHalves(window.frame);
        part += outer.area();
        windows_.push_back(std::move(window));
    }
    whole_over_part_ =
        part > 0 ? static_cast<double>(frame.pixel_count()) / static_cast<double>(part) : 1;
    const auto start = std::chrono::steady_clock::now();
    for (Window& window : windows_) {
        const FilteredHalves halves = Halves(base, window.frame, cancel);
        window.scale = FilteredYardstick(halves);
        for (Plane& plane : window.scale) {
            for (float& v : plane) {
                v = 1 / (3 * (v + static_cast<float>(kRelMSEEpsilon)));
            }
        }
        AddBlocks(window, HalvesError(window.frame, halves, window.noise), &base_);
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
    const TileRect& r = window.inner;
    for (int y0 = r.y0; y0 < r.y1; y0 += kBlock) {
        for (int x0 = r.x0; x0 < r.x1; x0 += kBlock) {
            double sum = 0;
            int pixels = 0;
            for (int y = y0; y < std::min(y0 + kBlock, r.y1); ++y) {
                for (int x = x0; x < std::min(x0 + kBlock, r.x1); ++x, ++pixels) {
                    const auto i =
                        static_cast<std::size_t>(y) * static_cast<std::size_t>(window.frame.width) +
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
                  HalvesError(window.frame, Halves(denoiser, window.frame, cancel), window.noise),
                  &errors);
    }
    *seconds = (denoiser.GetNeeds().halves ? 1 : 0.5) * Seconds(start) * whole_over_part_;
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
    constexpr std::size_t kFewest = 8;  // blocks that say something of their spread
    const auto n = static_cast<double>(a.size());
    double sum = 0, squares = 0;
    for (std::size_t i = 0; i < a.size(); ++i) {
        const double d =
            std::clamp(a[i], -largest_, largest_) - std::clamp(b[i], -largest_, largest_);
        sum += d;
        squares += d * d;
    }
    if (a.size() < kFewest) {
        return {a.empty() ? 0 : sum / n, 0};
    }
    const double mean = sum / n;
    return {mean, std::sqrt(std::max(0.0, squares / n - mean * mean) / (n - 1))};
}

}  // namespace relume::denoise
