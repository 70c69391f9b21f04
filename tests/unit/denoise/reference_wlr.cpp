#include "tests/unit/denoise/reference_wlr.h"

#include <algorithm>
#include <array>
#include <cmath>

#include "tests/unit/denoise/solve_linear.h"

namespace relume::denoise {
namespace {

using Columns = std::array<double, kWlrColumns>;

// Eigenvalues and vectors of a symmetric matrix by rotations.
struct Component {
    double value;
    Columns vector;
};

std::vector<Component> FindComponents(std::array<Columns, kWlrColumns> a) {
    std::array<Columns, kWlrColumns> v{};
    for (std::size_t i = 0; i < kWlrColumns; ++i) {
        v[i][i] = 1;
    }
    for (int sweep = 0; sweep < 20; ++sweep) {
        for (std::size_t p = 0; p < kWlrColumns; ++p) {
            for (std::size_t q = p + 1; q < kWlrColumns; ++q) {
                const double angle = 0.5 * std::atan2(2 * a[p][q], a[q][q] - a[p][p]);
                const double c = std::cos(angle), s = std::sin(angle);
                for (std::size_t k = 0; k < kWlrColumns; ++k) {
                    const double x = a[k][p], y = a[k][q];
                    a[k][p] = c * x - s * y;
                    a[k][q] = s * x + c * y;
                }
                for (std::size_t k = 0; k < kWlrColumns; ++k) {
                    const double x = a[p][k], y = a[q][k];
                    a[p][k] = c * x - s * y;
                    a[q][k] = s * x + c * y;
                }
                for (std::size_t k = 0; k < kWlrColumns; ++k) {
                    const double x = v[p][k], y = v[q][k];
                    v[p][k] = c * x - s * y;
                    v[q][k] = s * x + c * y;
                }
            }
        }
    }
    std::vector<Component> out;
    for (std::size_t k = 0; k < kWlrColumns; ++k) {
        out.push_back({a[k][k], v[k]});
    }
    std::ranges::sort(out, [](const auto& x, const auto& y) { return x.value > y.value; });
    return out;
}

double Epanechnikov(double t) { return std::max(0.0, 0.75 * (1 - t * t)); }

}  // namespace

ReferenceWlr::ReferenceWlr(const WlrInput& input, int radius, int x, int y)
    : input_(input), pixel_(static_cast<std::size_t>(y * input.width + x)) {
    struct Pixel {
        std::size_t index;
        Columns columns;
    };
    std::vector<Pixel> window;
    Columns mean{}, center{};
    for (int v = std::max(0, y - radius); v <= std::min(input.height - 1, y + radius); ++v) {
        for (int u = std::max(0, x - radius); u <= std::min(input.width - 1, x + radius); ++u) {
            Pixel pixel{static_cast<std::size_t>(v * input.width + u), {}};
            pixel.columns[0] = static_cast<double>(u - x) / radius;
            pixel.columns[1] = static_cast<double>(v - y) / radius;
            for (std::size_t f = 0; f < kWlrFeatures; ++f) {
                pixel.columns[2 + f] = At(kWlrFeature + static_cast<int>(f), pixel.index);
                center[2 + f] = At(kWlrFeature + static_cast<int>(f), pixel_);
            }
            for (std::size_t k = 0; k < kWlrColumns; ++k) {
                mean[k] += pixel.columns[k];
            }
            window.push_back(pixel);
        }
    }
    for (double& value : mean) {
        value /= static_cast<double>(window.size());
    }
    // Largest deviations of depth, normal, albedo.
    double largest[3] = {};
    constexpr std::size_t kFirst[4] = {2, 3, 6, 9};
    for (const Pixel& pixel : window) {
        for (std::size_t g = 0; g < 3; ++g) {
            double squared = 0;
            for (std::size_t k = kFirst[g]; k < kFirst[g + 1]; ++k) {
                squared += (pixel.columns[k] - mean[k]) * (pixel.columns[k] - mean[k]);
            }
            largest[g] = std::max(largest[g], std::sqrt(squared));
        }
    }
    Columns scale{1, 1};
    for (std::size_t g = 0; g < 3; ++g) {
        for (std::size_t k = kFirst[g]; k < kFirst[g + 1]; ++k) {
            scale[k] = 1 / std::max(largest[g], 0.01);
        }
    }
    std::array<Columns, kWlrColumns> matrix{};
    double noise = 0;
    for (const Pixel& pixel : window) {
        for (std::size_t a = 0; a < kWlrColumns; ++a) {
            for (std::size_t b = 0; b < kWlrColumns; ++b) {
                matrix[a][b] += (pixel.columns[a] - mean[a]) * scale[a] *
                                (pixel.columns[b] - mean[b]) * scale[b];
            }
        }
        for (std::size_t g = 0; g < 3; ++g) {
            noise += At(kWlrNoise + static_cast<int>(g), pixel.index) * scale[kFirst[g]] *
                     scale[kFirst[g]];
        }
    }
    const auto components = FindComponents(matrix);
    const double least = 0.01 + 2 * std::sqrt(noise) / (0.5 * std::sqrt(kWlrColumns));
    for (std::size_t k = 0; k < kWlrColumns; ++k) {
        const double singular = std::sqrt(std::max(0.0, components[k].value));
        dimensions_ =
            singular > least ? std::max(dimensions_, static_cast<int>(k) + 1) : dimensions_;
        margin_ = k < 2 ? margin_ : std::min(margin_, std::abs(singular / least - 1));
    }
    const double grey = At(kWlrGrey, pixel_), deviation = At(kWlrDeviation, pixel_);
    for (const Pixel& pixel : window) {
        if (std::abs(At(kWlrGrey, pixel.index) - grey) >
            3 * (At(kWlrDeviation, pixel.index) + deviation) + 0.005) {
            continue;
        }
        Neighbour neighbour{pixel.index, {}};
        for (std::size_t q = 0; q < static_cast<std::size_t>(dimensions_); ++q) {
            for (std::size_t k = 0; k < kWlrColumns; ++k) {
                neighbour.place[q] +=
                    components[q].vector[k] * scale[k] * (pixel.columns[k] - center[k]);
            }
        }
        neighbours_.push_back(neighbour);
    }
    FindCurvature();
}

void ReferenceWlr::FindCurvature() {
    const auto d = static_cast<std::size_t>(dimensions_), n = 1 + 2 * d;
    std::vector<std::vector<double>> matrix(n, std::vector<double>(n, 0));
    std::vector<double> right[3] = {std::vector<double>(n, 0), std::vector<double>(n, 0),
                                    std::vector<double>(n, 0)};
    for (const Neighbour& j : neighbours_) {
        double w = 1;
        std::vector<double> terms(n, 1);
        for (std::size_t q = 0; q < d; ++q) {
            w *= Epanechnikov(j.place[q]);
            terms[1 + q] = j.place[q];
            terms[1 + d + q] = j.place[q] * j.place[q];
        }
        for (std::size_t a = 0; a < n; ++a) {
            for (std::size_t b = 0; b < n; ++b) {
                matrix[a][b] += w * terms[a] * terms[b];
            }
            for (std::size_t c = 0; c < 3; ++c) {
                right[c][a] += w * terms[a] *
                               (At(kWlrColor + static_cast<int>(c), j.pixel) -
                                At(kWlrColor + static_cast<int>(c), pixel_));
            }
        }
    }
    for (std::size_t a = 0; a < n; ++a) {
        matrix[a][a] += 1e-3;
    }
    std::fill_n(narrowness_, kColumns, 0.16);
    for (const auto& b : right) {
        const auto x = SolveLinear(matrix, b);
        for (std::size_t q = 0; q < d; ++q) {
            narrowness_[q] += 2 * std::abs(x[1 + d + q]) / 3;
        }
    }
}

ReferenceWlr::Fit ReferenceWlr::FitWith(double bandwidth) const {
    const auto d = static_cast<std::size_t>(dimensions_), n = 1 + d;
    std::vector<std::vector<double>> matrix(n, std::vector<double>(n, 0));
    std::vector<double> weight;
    int used = 0;
    for (const Neighbour& j : neighbours_) {
        double w = At(kWlrTrust, j.pixel);
        std::vector<double> terms(n, 1);
        for (std::size_t q = 0; q < d; ++q) {
            w *= Epanechnikov(j.place[q] * std::sqrt(narrowness_[q]) / bandwidth);
            terms[1 + q] = j.place[q];
        }
        used += w > 0 ? 1 : 0;
        weight.push_back(w);
        for (std::size_t a = 0; a < n; ++a) {
            for (std::size_t b = 0; b < n; ++b) {
                matrix[a][b] += w * terms[a] * terms[b];
            }
        }
    }
    Fit fit;
    for (int c = 0; c < 3; ++c) {
        fit.color[c] = At(kWlrColor + c, pixel_);
    }
    fit.variance = At(kWlrVariance, pixel_);
    if (used <= 1) {
        return fit;
    }
    for (std::size_t a = 0; a < n; ++a) {
        matrix[a][a] += 1e-4;
    }
    std::vector<double> unit(n, 0);
    unit[0] = 1;
    const auto effect = SolveLinear(matrix, unit);
    const auto sum_up = [&](bool positive_alone) {
        Fit out = fit;
        double total = 0, change[3] = {};
        out.variance = 0;
        for (std::size_t k = 0; k < neighbours_.size(); ++k) {
            double l = effect[0];
            for (std::size_t q = 0; q < d; ++q) {
                l += effect[1 + q] * neighbours_[k].place[q];
            }
            l *= weight[k];
            if (positive_alone) {
                l = std::max(0.0, l);
            }
            total += l;
            out.variance += l * l * At(kWlrVariance, neighbours_[k].pixel);
            for (int c = 0; c < 3; ++c) {
                change[c] += l * (At(kWlrColor + c, neighbours_[k].pixel) - fit.color[c]);
            }
        }
        for (int c = 0; c < 3; ++c) {
            out.color[c] += change[c] / (positive_alone ? total : 1);
        }
        out.variance /= positive_alone ? total * total : 1;
        return out;
    };
    const Fit all = sum_up(false);
    return *std::min_element(all.color, all.color + 3) < 0 ? sum_up(true) : all;
}

}  // namespace relume::denoise
