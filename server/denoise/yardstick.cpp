#include "server/denoise/yardstick.h"

#include <algorithm>
#include <cmath>
#include <vector>

#include "core/base/parallel.h"

namespace relume::denoise {
namespace {

constexpr int kRadius = 2;
// Squared distances at which a neighbour counts a quarter: albedo, normal, depth (relative).
constexpr float kApart[3] = {0.02f, 0.1f, 0.01f};
constexpr float kSigma = 1;  // pixels
constexpr float kEpsilon = 1e-2f, kNoiseWeight = 32;

struct Look {
    float feature[7];  // over the roots of kApart; depth as it is
    float inverse_depth2;
};

std::vector<Look> ReadLooks(const Frame& frame) {
    std::vector<Look> looks(frame.pixel_count(), Look{});
    for (int f = kAlbedoR; f <= kDepth; ++f) {
        const Plane& plane = frame.feature[f];
        if (plane.empty()) {
            continue;
        }
        const float scale = f < kNormalX ? 1 / std::sqrt(kApart[0])
                            : f < kDepth ? 1 / std::sqrt(kApart[1])
                                         : 1;
        for (std::size_t i = 0; i < plane.size(); ++i) {
            looks[i].feature[f] = plane[i] * scale;
            if (f == kDepth) {
                looks[i].inverse_depth2 = 1 / (kApart[2] * plane[i] * plane[i] + 1e-30f);
            }
        }
    }
    return looks;
}

float Apart(const Look& a, const Look& b) {
    float sum = 0;
    for (int f = 0; f < 6; ++f) {
        const float d = a.feature[f] - b.feature[f];
        sum += d * d;
    }
    const float depth = a.feature[kDepth] - b.feature[kDepth];
    return sum + depth * depth * a.inverse_depth2;
}

}  // namespace

std::array<Plane, 3> SquaredYardstick(const Frame& frame) {
    static_assert(kDepth == 6);
    const std::vector<Look> looks = ReadLooks(frame);
    float spatial[2 * kRadius * kRadius + 1];
    for (int d2 = 0; d2 <= 2 * kRadius * kRadius; ++d2) {
        spatial[d2] = std::exp(-static_cast<float>(d2) / (2 * kSigma * kSigma));
    }
    std::array<Plane, 3> squares;
    for (Plane& plane : squares) {
        plane.resize(frame.pixel_count());
    }
    const int width = frame.width, height = frame.height;
    ParallelFor(0, static_cast<std::size_t>(height), 8, [&](std::size_t y0, std::size_t y1) {
        for (int y = static_cast<int>(y0); y < static_cast<int>(y1); ++y) {
            for (int x = 0; x < width; ++x) {
                const auto at = [width](int u, int v) {
                    return static_cast<std::size_t>(v) * static_cast<std::size_t>(width) +
                           static_cast<std::size_t>(u);
                };
                const std::size_t i = at(x, y);
                float weights = 0, sum[3] = {}, variance[3] = {};
                for (int v = std::max(y - kRadius, 0); v <= std::min(y + kRadius, height - 1);
                     ++v) {
                    for (int u = std::max(x - kRadius, 0); u <= std::min(x + kRadius, width - 1);
                         ++u) {
                        const std::size_t j = at(u, v);
                        if (j == i) {
                            continue;
                        }
                        const float near = 1 + Apart(looks[i], looks[j]);
                        const float weight =
                            spatial[(u - x) * (u - x) + (v - y) * (v - y)] / (near * near);
                        weights += weight;
                        for (int c = 0; c < 3; ++c) {
                            sum[c] += weight * frame.color[c][j];
                            variance[c] += weight * frame.variance[c][j];
                        }
                    }
                }
                for (std::size_t c = 0; c < 3; ++c) {
                    const float own = frame.color[c][i];
                    const float mean = weights > 0 ? sum[c] / weights : own;
                    // A pixel that saw nothing knows nothing of its noise either.
                    const float noise =
                        std::max(frame.variance[c][i], weights > 0 ? variance[c] / weights : 0.0f);
                    const bool known = kNoiseWeight * noise < mean * mean + kEpsilon;
                    squares[c][i] = known ? own * own : mean * mean;
                }
            }
        }
    });
    return squares;
}

}  // namespace relume::denoise
