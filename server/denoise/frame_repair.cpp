#include "server/denoise/frame_repair.h"

#include <algorithm>
#include <cmath>

#include "server/denoise/planes.h"

namespace relume::denoise {
namespace {

// Calls fn(j) for the pixels of i's 3x3 window, i itself left out.
template <typename Fn>
void ForNeighbours(int width, int height, std::size_t i, const Fn& fn) {
    const int x = static_cast<int>(i % static_cast<std::size_t>(width));
    const int y = static_cast<int>(i / static_cast<std::size_t>(width));
    for (int v = std::max(y - 1, 0); v <= std::min(y + 1, height - 1); ++v) {
        for (int u = std::max(x - 1, 0); u <= std::min(x + 1, width - 1); ++u) {
            if (u != x || v != y) {
                fn(static_cast<std::size_t>(v) * width + u);
            }
        }
    }
}

}  // namespace

bool IsUsable(float value) { return std::abs(value) <= kLargestValue; }

void FillHoles(int width, int height, const Holes& holes, const std::vector<Plane*>& values,
               const std::vector<Plane*>& variances) {
    Holes open = holes;
    std::vector<std::size_t> ring;
    for (std::size_t i = 0; i < open.size(); ++i) {
        if (open[i] != 0) {
            for (Plane* plane : values) {
                (*plane)[i] = 0;
            }
            for (Plane* plane : variances) {
                (*plane)[i] = 0;
            }
            bool at_rim = false;
            ForNeighbours(width, height, i,
                          [&](std::size_t j) { at_rim = at_rim || open[j] == 0; });
            if (at_rim) {
                ring.push_back(i);
            }
        }
    }
    while (!ring.empty()) {
        for (const std::size_t i : ring) {
            float count = 0;
            ForNeighbours(width, height, i, [&](std::size_t j) {
                if (open[j] == 0) {
                    count += 1;
                    for (Plane* plane : values) {
                        (*plane)[i] += (*plane)[j];
                    }
                    for (Plane* plane : variances) {
                        (*plane)[i] = std::max((*plane)[i], (*plane)[j]);
                    }
                }
            });
            for (Plane* plane : values) {
                (*plane)[i] /= count;
            }
        }
        for (const std::size_t i : ring) {
            open[i] = 0;
        }
        std::vector<std::size_t> next;
        for (const std::size_t i : ring) {
            ForNeighbours(width, height, i, [&](std::size_t j) {
                if (open[j] != 0) {
                    next.push_back(j);
                }
            });
        }
        std::sort(next.begin(), next.end());
        next.erase(std::unique(next.begin(), next.end()), next.end());
        ring = std::move(next);
    }
}

bool PoolUnknown(int width, int height, const Plane& freedom, Plane* variance) {
    Plane weighted(freedom.size());
    double frame_sum = 0, frame_freedom = 0;
    bool all_known = true;
    for (std::size_t i = 0; i < freedom.size(); ++i) {
        weighted[i] = freedom[i] > 0 ? freedom[i] * (*variance)[i] : 0;
        frame_sum += weighted[i];
        frame_freedom += freedom[i];
        all_known = all_known && freedom[i] > 0;
    }
    if (all_known || frame_freedom <= 0) {
        return all_known;
    }
    const Plane sum = SumBox(weighted, width, height, 2);
    const Plane total = SumBox(freedom, width, height, 2);
    const auto frame_mean = static_cast<float>(frame_sum / frame_freedom);
    for (std::size_t i = 0; i < freedom.size(); ++i) {
        if (freedom[i] <= 0) {
            (*variance)[i] = total[i] > 0 ? sum[i] / total[i] : frame_mean;
        }
    }
    return true;
}

Plane Regularise(int width, int height, const Plane& sample, const Plane& halves,
                 const Plane& known) {
    constexpr int kRadius = 10;
    Plane known_sample(sample.size()), known_halves(sample.size());
    for (std::size_t i = 0; i < sample.size(); ++i) {
        known_sample[i] = known[i] > 0 ? sample[i] : 0;
        known_halves[i] = known[i] > 0 ? halves[i] : 0;
    }
    const Plane sample_sum = SumBox(known_sample, width, height, kRadius);
    const Plane halves_sum = SumBox(known_halves, width, height, kRadius);
    const Plane count = SumBox(known, width, height, kRadius);
    Plane out(sample.size());
    for (std::size_t i = 0; i < out.size(); ++i) {
        out[i] = count[i] > 0 ? sample[i] * (halves_sum[i] / (1e-10f * count[i] + sample_sum[i]))
                              : sample[i];
    }
    return out;
}

Plane LocalDifferenceVariance(int width, int height, const Plane& values) {
    Plane squared(values.size(), 0.0f), inside(values.size(), 0.0f);
    for (int y = 1; y + 1 < height; ++y) {
        for (int x = 1; x + 1 < width; ++x) {
            const auto at = [&](int dx, int dy) {
                return values[static_cast<std::size_t>(y + dy) * width +
                              static_cast<std::size_t>(x + dx)];
            };
            const float edges = at(0, -1) + at(-1, 0) + at(1, 0) + at(0, 1);
            const float corners = at(-1, -1) + at(1, -1) + at(-1, 1) + at(1, 1);
            const float response = 4 * at(0, 0) - 2 * edges + corners;
            const std::size_t i = static_cast<std::size_t>(y) * width + x;
            squared[i] = response * response * (1.0f / 36.0f);
            inside[i] = 1;
        }
    }
    Plane out = SumBox(squared, width, height, 2);
    const Plane count = SumBox(inside, width, height, 2);
    for (std::size_t i = 0; i < out.size(); ++i) {
        out[i] = count[i] > 0 ? out[i] / count[i] : 0;
    }
    return out;
}

}  // namespace relume::denoise
