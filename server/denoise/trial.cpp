#include "server/denoise/trial.h"

#include <algorithm>
#include <chrono>
#include <cmath>
#include <numeric>
#include <utility>

#include "core/image/metrics.h"
#include "server/denoise/blend.h"
#include "server/denoise/error_estimate.h"
#include "server/denoise/halves.h"

namespace relume::denoise {
namespace {

constexpr int kShare = 16;              // one part in so many is judged
constexpr int kBlock = 16;              // pixels a side
constexpr double kLargestShare = 0.02;  // of differences is cut off
constexpr int kTenths = 10;
constexpr double kFewestSamples = 8;  // a pixel, to tell filters apart by

std::size_t PixelOf(const Trial::Window& window, int x, int y) {
    return static_cast<std::size_t>(y) * static_cast<std::size_t>(window.part.frame.width) +
           static_cast<std::size_t>(x);
}

// All weights of `count` runs from 1 up that add up to `sum`.
void ListWeights(std::size_t count, int sum, std::vector<int>* head,
                 std::vector<std::vector<int>>* all) {
    if (head->size() + 1 == count) {
        all->push_back(*head);
        all->back().push_back(sum);
        return;
    }
    for (int w = 1; w <= sum - static_cast<int>(count - head->size() - 1); ++w) {
        head->push_back(w);
        ListWeights(count, sum - w, head, all);
        head->pop_back();
    }
}

}  // namespace

Trial::Trial(const Frame& frame) {
    std::size_t part = 0;
    for (const TileRect& rect : ChooseWindows(frame, kShare)) {
        Window window{CutPart(frame, rect), {}};
        part += window.part.frame.pixel_count();
        window.noise = VarianceByHalves(window.part.frame);
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

Trial::Run Trial::Filter(const Denoiser& denoiser, int halves, const CancelToken& cancel) const {
    const auto start = std::chrono::steady_clock::now();
    Run run;
    for (int half = 0; half < halves; ++half) {
        auto& windows = run.halves.emplace_back();
        for (const Window& window : windows_) {
            windows.push_back(FilterHalf(denoiser, window.part.frame, half, cancel));
        }
    }
    run.seconds = whole_over_part_ / halves *
                  std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
    return run;
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
                        mean += share * run->halves[static_cast<std::size_t>(half)][w][c][i];
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
    return scale_[window][channel][pixel] *
           HeldOutProduct(of.part.frame.half[1 - half][channel][pixel], f, g,
                          of.noise[channel][pixel]);
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
                        const float f = run.halves[static_cast<std::size_t>(half)][w][c][i];
                        sum += Product(w, c, i, half, f, f);
                    }
                }
            }
        }
        errors.push_back(sum / (static_cast<double>(block.area()) * halves));
    });
    return errors;
}

Judge::Mean Judge::BestMean(std::span<const Trial::Run* const> runs) const {
    const std::size_t n = runs.size();
    // Of errors i and j, a block each: the squared error of a mean is quadratic in the weights.
    std::vector<std::vector<double>> products;
    EachBlock([&](std::size_t w, const TileRect& block) {
        std::vector<double>& sums = products.emplace_back(n * n, 0.0);
        std::vector<float> values(n);
        for (int y = block.y0; y < block.y1; ++y) {
            for (int x = block.x0; x < block.x1; ++x) {
                const std::size_t i = PixelOf(trial_.windows()[w], x, y);
                for (std::size_t c = 0; c < 3; ++c) {
                    for (int half = 0; half < halves_; ++half) {
                        for (std::size_t k = 0; k < n; ++k) {
                            values[k] = runs[k]->halves[static_cast<std::size_t>(half)][w][c][i];
                        }
                        DrawTogether(values);
                        for (std::size_t k = 0; k < n; ++k) {
                            for (std::size_t l = 0; l <= k; ++l) {
                                sums[k * n + l] += Product(w, c, i, half, values[k], values[l]);
                            }
                        }
                    }
                }
            }
        }
        for (double& sum : sums) {
            sum /= static_cast<double>(block.area()) * halves_;
        }
    });
    const auto errors = [&](const std::vector<int>& weights) {
        Errors of;
        double all = 0;
        for (const int weight : weights) {
            all += weight;
        }
        for (const std::vector<double>& block : products) {
            double sum = 0;
            for (std::size_t k = 0; k < n; ++k) {
                for (std::size_t l = 0; l <= k; ++l) {
                    sum += (k == l ? 1 : 2) * weights[k] * weights[l] * block[k * n + l];
                }
            }
            of.push_back(sum / (all * all) + correction_[of.size()]);
        }
        return of;
    };
    Mean best{std::vector<int>(n, 1), errors(std::vector<int>(n, 1))};
    if (!trial_.tells()) {
        return best;
    }
    const Errors equal = best.errors;
    double least = 0;
    std::vector<std::vector<int>> all;
    std::vector<int> head;
    ListWeights(n, kTenths, &head, &all);
    for (const std::vector<int>& weights : all) {
        Errors of = errors(weights);
        const Difference gain = Compare(of, equal);
        if (gain.mean + gain.error < least) {
            least = gain.mean + gain.error;
            best = {weights, std::move(of)};
        }
    }
    return best;
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
