#include "server/denoise/trial.h"

#include <algorithm>
#include <chrono>
#include <cmath>
#include <numeric>
#include <utility>

#include "core/image/metrics.h"
#include "server/denoise/crop_frame.h"
#include "server/denoise/error_estimate.h"
#include "server/denoise/halves.h"
#include "server/denoise/net.h"
#include "server/denoise/seen_lights.h"

namespace relume::denoise {
namespace {

constexpr int kShare = 16;              // one part in so many is judged
constexpr double kPixelsAWindow = 3e4;  // of a small frame, at least
constexpr std::size_t kFewestWindows = 4;
constexpr int kBlock = 16;              // pixels a side
constexpr double kLargestShare = 0.02;  // of differences is cut off
constexpr double kFewestSamples = 8;    // a pixel, to tell filters apart by

std::size_t PixelOf(const Trial::Window& window, int x, int y) {
    return static_cast<std::size_t>(y) * static_cast<std::size_t>(window.part.frame.width) +
           static_cast<std::size_t>(x);
}

// Of a large frame some of those that the estimate of its error looks at, which so need not be
// filtered again.
std::vector<TileRect> WindowsToTry(const Frame& frame) {
    const auto pixels = static_cast<double>(frame.pixel_count());
    const double few = std::clamp(pixels / kPixelsAWindow, 1.0, 8.0);
    const std::vector<TileRect> all = WindowsToJudge(frame);
    if (all.size() <= 1) {
        return ChooseWindows(frame, kShare, few);
    }
    const std::size_t count = std::min(all.size(), ChooseWindows(frame, kShare, few).size());
    std::vector<TileRect> some;
    for (std::size_t k = 0; k < count; ++k) {
        some.push_back(all[k * all.size() / count]);
    }
    return some;
}

}  // namespace

Trial::Trial(const Frame& frame) {
    std::size_t part = 0;
    is_small_ = WindowsToJudge(frame).size() <= 1;
    for (const TileRect& rect : WindowsToTry(frame)) {
        Window window{CutPart(frame, rect), {}, {}, {}};
        part += window.part.frame.pixel_count();
        for (const int half : {0, 1}) {
            window.half[static_cast<std::size_t>(half)] = HalfFrame(window.part.frame, half);
        }
        window.noise = VarianceByHalves(window.part.frame);
        window.lights = FindSeenLights(window.part.frame);
        windows_.push_back(std::move(window));
    }
    if (!frame.count.empty()) {
        samples_ = std::accumulate(frame.count.begin(), frame.count.end(), 0.0) /
                   static_cast<double>(frame.pixel_count());
    }
    whole_over_part_ =
        part > 0 ? static_cast<double>(frame.pixel_count()) / static_cast<double>(part) : 1;
}

bool Trial::tells() const { return samples_ == 0 || samples_ >= kFewestSamples; }

bool Trial::is_wide() const { return whole_over_part_ <= 1 || windows_.size() >= kFewestWindows; }

template <class Make>
Trial::Run Trial::RunEach(int halves, Make make) const {
    const auto start = std::chrono::steady_clock::now();
    Run run;
    for (std::size_t half = 0; half < static_cast<std::size_t>(halves); ++half) {
        auto& windows = run.halves.emplace_back();
        for (std::size_t w = 0; w < windows_.size(); ++w) {
            windows.push_back(make(half, w));
        }
    }
    run.seconds = whole_over_part_ / halves *
                  std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
    return run;
}

Trial::Run Trial::Filter(const Denoiser& denoiser, int halves, const CancelToken& cancel) const {
    return RunEach(halves, [&](std::size_t half, std::size_t w) {
        return RunDenoiser(denoiser, windows_[w].half[half], cancel);
    });
}

std::vector<WindowError> Trial::JudgeWindows(const Run& run) const {
    std::vector<WindowError> errors;
    for (std::size_t w = 0; w < windows_.size(); ++w) {
        FilteredHalves halves;
        for (std::size_t half = 0; half < 2; ++half) {
            std::ranges::copy(run.halves[half][w].color, halves.color[half].begin());
        }
        errors.push_back(JudgeWindow(windows_[w].part, halves));
    }
    return errors;
}

Trial::Whole Trial::FilterWhole(const Denoiser& denoiser, const Frame& frame,
                                const CancelToken& cancel) const {
    const auto start = std::chrono::steady_clock::now();
    Whole whole;
    for (const int half : {0, 1}) {
        Result result = RunDenoiser(denoiser, HalfFrame(frame, half), cancel);
        auto& windows = whole.run.halves.emplace_back();
        for (const Window& window : windows_) {
            Result& part = windows.emplace_back();
            for (std::size_t c = 0; c < 3; ++c) {
                part.color[c] = CropPlane(result.color[c], frame.width, window.part.outer);
            }
            if (result.error) {
                part.error = CropPlane(*result.error, frame.width, window.part.outer);
            }
        }
        std::ranges::move(result.color, whole.halves.color[static_cast<std::size_t>(half)].begin());
    }
    whole.run.seconds =
        std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count() / 2;
    return whole;
}

Trial::Run Trial::Mix(const std::array<const Run*, kNetSlotCount>& runs, int halves,
                      const CancelToken& cancel) const {
    return RunEach(halves, [&](std::size_t half, std::size_t w) {
        const Frame& frame = windows_[w].half[half];
        Result noisy;
        std::ranges::copy(frame.color, std::begin(noisy.color));
        NetCandidates candidates = {&noisy};
        for (std::size_t k = 1; k < kNetSlotCount; ++k) {
            candidates[k] = runs[k] == nullptr ? nullptr : &runs[k]->halves[half][w];
        }
        Result result;
        std::ranges::move(MixByNetwork(frame, candidates, cancel).color, std::begin(result.color));
        return result;
    });
}

Judge::Judge(const Trial& trial, std::span<const Trial::Run* const> runs, int halves)
    : trial_(trial), halves_(halves) {
    const auto share = 1.0f / static_cast<float>(runs.size() * static_cast<std::size_t>(halves));
    for (std::size_t w = 0; w < trial.windows().size(); ++w) {
        std::array<Plane, 3>& scale = scale_.emplace_back();
        for (std::size_t c = 0; c < 3; ++c) {
            scale[c].resize(trial.windows()[w].part.frame.pixel_count());
            for (std::size_t i = 0; i < scale[c].size(); ++i) {
                float mean = 0;
                for (const Trial::Run* run : runs) {
                    for (int half = 0; half < halves; ++half) {
                        mean += share * run->halves[static_cast<std::size_t>(half)][w].color[c][i];
                    }
                }
                scale[c][i] = 1 / (3 * (mean * mean + static_cast<float>(kRelMSEEpsilon)));
            }
        }
    }
    const Errors some = Of(*runs[0], halves), both = Of(*runs[0], 2);
    for (std::size_t block = 0; block < both.size(); ++block) {
        correction_.push_back(both[block] - some[block]);
    }
}

template <class Body>
void Judge::EachBlock(Body body) const {
    for (std::size_t w = 0; w < trial_.windows().size(); ++w) {
        const TileRect& r = trial_.windows()[w].part.inner;
        for (int y0 = r.y0; y0 < r.y1; y0 += kBlock) {
            for (int x0 = r.x0; x0 < r.x1; x0 += kBlock) {
                body(w, TileRect{x0, y0, std::min(x0 + kBlock, r.x1), std::min(y0 + kBlock, r.y1)});
            }
        }
    }
}

float Judge::Product(std::size_t window, std::size_t channel, std::size_t pixel, int half, float f,
                     float g) const {
    const Trial::Window& of = trial_.windows()[window];
    const float noise = of.noise[channel][pixel];
    return scale_[window][channel][pixel] *
           (!of.lights.empty() && of.lights[pixel] != 0
                ? noise
                : HeldOutProduct(of.part.frame.half[1 - half][channel][pixel], f, g, noise));
}

Judge::Errors Judge::OfNone() const {
    Errors errors;
    EachBlock([&](std::size_t w, const TileRect& block) {
        const Trial::Window& window = trial_.windows()[w];
        double sum = 0;
        for (int y = block.y0; y < block.y1; ++y) {
            for (int x = block.x0; x < block.x1; ++x) {
                const std::size_t i = PixelOf(window, x, y);
                for (std::size_t c = 0; c < 3; ++c) {
                    sum += window.noise[c][i] * scale_[w][c][i];
                }
            }
        }
        errors.push_back(sum / static_cast<double>(block.area()));
    });
    return errors;
}

Judge::Errors Judge::Of(const Trial::Run& run) const {
    Errors errors = Of(run, halves_);
    for (std::size_t block = 0; block < errors.size(); ++block) {
        errors[block] += correction_[block];
    }
    return errors;
}

Judge::Errors Judge::Of(const Trial::Run& run, int halves) const {
    Errors errors;
    EachBlock([&](std::size_t w, const TileRect& block) {
        double sum = 0;
        for (int y = block.y0; y < block.y1; ++y) {
            for (int x = block.x0; x < block.x1; ++x) {
                const std::size_t i = PixelOf(trial_.windows()[w], x, y);
                for (std::size_t c = 0; c < 3; ++c) {
                    for (int half = 0; half < halves; ++half) {
                        const float f = run.halves[static_cast<std::size_t>(half)][w].color[c][i];
                        sum += Product(w, c, i, half, f, f);
                    }
                }
            }
        }
        errors.push_back(sum / (static_cast<double>(block.area()) * halves));
    });
    return errors;
}

Judge::Difference Judge::Compare(const Errors& a, const Errors& b) {
    constexpr std::size_t kFewestBlocks = 8;  // that say something of their spread
    const auto n = static_cast<double>(a.size());
    std::vector<double> differences(a.size()), sizes(a.size());
    for (std::size_t i = 0; i < a.size(); ++i) {
        differences[i] = a[i] - b[i];
        sizes[i] = std::abs(differences[i]);
    }
    double largest = 0;
    if (!sizes.empty()) {
        const auto kept =
            sizes.begin() + static_cast<std::ptrdiff_t>((1 - kLargestShare) *
                                                        static_cast<double>(sizes.size() - 1));
        std::nth_element(sizes.begin(), kept, sizes.end());
        largest = *kept;
    }
    const double of = n > 0 ? std::accumulate(b.begin(), b.end(), 0.0) / n : 0;
    double sum = 0, squares = 0;
    for (double d : differences) {
        d = std::clamp(d, -largest, largest);
        sum += d;
        squares += d * d;
    }
    if (a.size() < kFewestBlocks) {
        return {a.empty() ? 0 : sum / n, 0, of};
    }
    const double mean = sum / n;
    return {mean, std::sqrt(std::max(0.0, squares / n - mean * mean) / (n - 1)), of};
}

Judge::Ratio Judge::Divide(const Errors& a, const Errors& b) {
    const double above = std::accumulate(a.begin(), a.end(), 0.0);
    const double below = std::accumulate(b.begin(), b.end(), 0.0);
    if (!(above > 0 && below > 0)) {
        return {1, 0};
    }
    const double ratio = above / below;
    double squares = 0;
    for (std::size_t i = 0; i < a.size(); ++i) {
        const double d = a[i] - ratio * b[i];
        squares += d * d;
    }
    return {ratio, std::sqrt(squares) / below};
}

}  // namespace relume::denoise
