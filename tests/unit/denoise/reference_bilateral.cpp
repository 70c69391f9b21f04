#include "tests/unit/denoise/reference_bilateral.h"

#include <algorithm>
#include <cmath>
#include <vector>

namespace relume::denoise {
namespace {

double Square(double x) { return x * x; }

struct Group {
    int first, count;
    double scale;  // to the filter's units
};

// Normal, albedo, depth over the frame's largest.
std::array<Group, 3> Groups(const Frame& frame) {
    const double largest = *std::ranges::max_element(frame.feature[kDepth]);
    return {{{kNormalX, 3, 1}, {kAlbedoR, 3, 1}, {kDepth, 1, 1 / largest}}};
}

// |f_i - f_j|^2 and s_i^2 + s_j^2 of a group.
std::pair<double, double> Compare(const Frame& frame, const Group& group, std::size_t i,
                                  std::size_t j) {
    double distance = 0, variance = 0;
    for (int f = group.first; f < group.first + group.count; ++f) {
        distance += Square(group.scale * (frame.feature[f][i] - frame.feature[f][j]));
        variance +=
            Square(group.scale) * (frame.feature_variance[f][i] + frame.feature_variance[f][j]);
    }
    return {distance, variance};
}

// Exponent of the weights of corrected and robust mode.
double FeatureExponent(const Frame& frame, std::size_t i, std::size_t j) {
    constexpr double kSigma[3] = {0.8, 0.25, 0.6};
    const auto groups = Groups(frame);
    double e = 0;
    for (std::size_t g = 0; g < 3; ++g) {
        const auto [distance, variance] = Compare(frame, groups[g], i, j);
        e += distance / (std::max(variance, 1e-2) * 2 * Square(kSigma[g]));
    }
    return e;
}

// Calls fn(j, dx, dy) for the window of pixel i, clipped.
template <typename Fn>
void ForWindow(const Frame& frame, int x, int y, int radius, const Fn& fn) {
    for (int v = std::max(y - radius, 0); v <= std::min(y + radius, frame.height - 1); ++v) {
        for (int u = std::max(x - radius, 0); u <= std::min(x + radius, frame.width - 1); ++u) {
            fn(static_cast<std::size_t>(v * frame.width + u), u - x, v - y);
        }
    }
}

// For how many pixels the one at (dx, dy) counts: wide windows leave out most of what is far.
int Stands(int dx, int dy) {
    const int squared = dx * dx + dy * dy;
    if (4 * squared > 33 * 33) {
        return 0;
    }
    if (4 * squared > 27 * 27) {
        return dx % 2 == 0 && dy % 2 == 0 ? 4 : 0;
    }
    return 4 * squared <= 21 * 21 ? 1 : (dx + dy) % 2 == 0 ? 2 : 0;
}

double Grey(const Frame& frame, int x, int y) {
    const auto i = static_cast<std::size_t>(std::clamp(y, 0, frame.height - 1) * frame.width +
                                            std::clamp(x, 0, frame.width - 1));
    return (static_cast<double>(frame.color[0][i]) + frame.color[1][i] + frame.color[2][i]) / 3;
}

double Sobel(const Frame& frame, int x, int y) {
    double across = 0, down = 0;
    for (int k = -1; k <= 1; ++k) {
        const double weight = 2 - std::abs(k);
        across += weight * (Grey(frame, x + 1, y + k) - Grey(frame, x - 1, y + k));
        down += weight * (Grey(frame, x + k, y + 1) - Grey(frame, x + k, y - 1));
    }
    return std::sqrt(across * across + down * down);
}

// Chance that a Poisson variable of mean lambda is at most n.
double PoissonCdf(int n, double lambda) {
    double sum = 0;
    for (int k = 0; k <= n; ++k) {
        sum += std::exp(k * std::log(std::max(lambda, 1e-300)) - lambda - std::lgamma(k + 1.0));
    }
    return sum;
}

ReferenceResult EmptyResult(const Frame& frame) {
    ReferenceResult result;
    for (Plane* plane : {&result.color[0], &result.color[1], &result.color[2], &result.sure}) {
        plane->resize(frame.pixel_count());
    }
    return result;
}

}  // namespace

ReferenceResult ReferenceRobust(const Frame& frame, double sigma_s, bool ranged) {
    const std::size_t pixels = frame.pixel_count();
    // Colours and their variances after the window of sigma 1.
    std::vector<double> guide[3], noise[3];
    for (int c = 0; c < 3; ++c) {
        guide[c].resize(pixels);
        noise[c].resize(pixels);
    }
    for (int y = 0, p = 0; y < frame.height; ++y) {
        for (int x = 0; x < frame.width; ++x, ++p) {
            const auto i = static_cast<std::size_t>(p);
            double weights = 0;
            ForWindow(frame, x, y, 2, [&](std::size_t j, int dx, int dy) {
                const double w =
                    std::exp(-0.5 * (dx * dx + dy * dy) - FeatureExponent(frame, i, j));
                weights += w;
                for (int c = 0; c < 3; ++c) {
                    guide[c][i] += w * frame.color[c][j];
                    noise[c][i] += w * w * frame.variance[c][j];
                }
            });
            for (int c = 0; c < 3; ++c) {
                guide[c][i] /= weights;
                noise[c][i] /= weights * weights;
            }
        }
    }
    const int radius = std::min(16, static_cast<int>(std::lround(2 * sigma_s)));
    ReferenceResult result = EmptyResult(frame);
    for (int y = 0, p = 0; y < frame.height; ++y) {
        for (int x = 0; x < frame.width; ++x, ++p) {
            const auto i = static_cast<std::size_t>(p);
            double weights = 0, sum[3] = {};
            ForWindow(frame, x, y, radius, [&](std::size_t j, int dx, int dy) {
                double range = 0;
                for (int c = 0; c < 3; ++c) {
                    const double vi = noise[c][i], vj = noise[c][j];
                    range += (Square(guide[c][j] - guide[c][i]) - vi - std::min(vi, vj)) /
                             (3 * (2 * 1.5 * (vi + vj) + 1e-10));
                }
                const double w =
                    Stands(dx, dy) *
                    std::exp(-(dx * dx + dy * dy) / (2 * sigma_s * sigma_s) -
                             FeatureExponent(frame, i, j) - (ranged ? std::max(range, 0.0) : 0.0));
                weights += w;
                for (int c = 0; c < 3; ++c) {
                    sum[c] += w * frame.color[c][j];
                }
            });
            for (int c = 0; c < 3; ++c) {
                result.color[c][i] = static_cast<float>(sum[c] / weights);
            }
        }
    }
    return result;
}

ReferenceResult ReferenceCorrected(const Frame& frame, double sigma_s) {
    const int radius = std::min(16, static_cast<int>(std::lround(2 * sigma_s)));
    ReferenceResult result = EmptyResult(frame);
    for (int y = 0, p = 0; y < frame.height; ++y) {
        for (int x = 0; x < frame.width; ++x, ++p) {
            const auto i = static_cast<std::size_t>(p);
            double weights = 0, sum[3] = {};
            ForWindow(frame, x, y, radius, [&](std::size_t j, int dx, int dy) {
                const double e =
                    (dx * dx + dy * dy) / (2 * sigma_s * sigma_s) + FeatureExponent(frame, i, j);
                const double w = Stands(dx, dy) * std::exp(-e);
                weights += w;
                for (int c = 0; c < 3; ++c) {
                    sum[c] += w * frame.color[c][j];
                }
            });
            double sure = 0;
            for (int c = 0; c < 3; ++c) {
                const double filtered = sum[c] / weights, v = frame.variance[c][i];
                sure += (Square(filtered - frame.color[c][i]) - v + 2 * v / weights) / 3;
                result.color[c][i] = static_cast<float>(filtered);
            }
            result.sure[i] = static_cast<float>(sure);
        }
    }
    return result;
}

ReferenceResult ReferencePrinted(const Frame& frame, double sigma_s, int taylor) {
    constexpr double kSigma[3] = {0.4, 0.125, 0.3}, kRange = 8;
    const auto groups = Groups(frame);
    ReferenceResult result = EmptyResult(frame);
    for (int y = 0, p = 0; y < frame.height; ++y) {
        for (int x = 0; x < frame.width; ++x, ++p) {
            const auto i = static_cast<std::size_t>(p);
            const double gi = Sobel(frame, x, y);
            double neighbours = 0, sum[3] = {};
            ForWindow(frame, x, y, 8, [&](std::size_t j, int dx, int dy) {
                const double gj = Sobel(frame, x + dx, y + dy);
                if (j == i || std::abs(gj - gi) < 1e-12) {
                    return;
                }
                double e = 0;
                for (int c = 0; c < 3; ++c) {
                    e += Square(frame.color[c][i] - frame.color[c][j]) / (2 * Square(kRange));
                }
                for (int g = 0; g < 3; ++g) {
                    const auto [distance, variance] =
                        Compare(frame, groups[static_cast<std::size_t>(g)], i, j);
                    e += std::sqrt(distance / std::max(variance, 1e-10)) / (2 * Square(kSigma[g]));
                }
                const double slope = std::abs(gj - gi) / std::hypot(dx, dy);
                const double gauss = std::exp(-Square(gj - gi) / (2 * Square(sigma_s)));
                const double lambda = gi * gj / Square(sigma_s);
                const double part = taylor > 0 && lambda <= 80 ? PoissonCdf(taylor, lambda) : 1.0;
                const double w = slope * gauss * part * std::exp(-std::min(e, 80.0));
                neighbours += w;
                for (int c = 0; c < 3; ++c) {
                    sum[c] += w * frame.color[c][j];
                }
            });
            for (int c = 0; c < 3; ++c) {
                const double own = frame.color[c][i];
                result.color[c][i] = static_cast<float>(
                    neighbours < 1e-12 ? own : (own + sum[c]) / (1 + neighbours));
            }
        }
    }
    return result;
}

}  // namespace relume::denoise
