#include "tests/unit/denoise/reference_regression.h"

#include <algorithm>
#include <cmath>
#include <utility>
#include <vector>

#include "tests/unit/denoise/reference_nlm.h"
#include "tests/unit/denoise/solve_linear.h"

namespace relume::denoise {
namespace {

using Row = std::vector<double>;

struct Neighbour {
    std::size_t pixel;
    double weight;
    Row columns;  // x, y, features
};

}  // namespace

std::array<Plane, 3> ReferenceRegression(const RegressionInput& input, double ridge) {
    const int width = input.guide.width, height = input.guide.height;
    const ReferenceNlm nlm(input.guide, input.weights);
    const std::size_t pixels = static_cast<std::size_t>(width) * static_cast<std::size_t>(height);
    std::array<Row, 4> sums;
    for (Row& sum : sums) {
        sum.assign(pixels, 0);
    }
    const int r = kRegressionRadius;
    for (int y = 0; y < height; ++y) {
        for (int x = 0; x < width; ++x) {
            std::vector<Neighbour> window;
            for (int v = std::max(y - r, 0); v <= std::min(y + r, height - 1); ++v) {
                for (int u = std::max(x - r, 0); u <= std::min(x + r, width - 1); ++u) {
                    Neighbour neighbour;
                    neighbour.pixel = static_cast<std::size_t>(v * width + u);
                    neighbour.weight = u == x && v == y ? 1 : nlm.Weight(x, y, u - x, v - y);
                    neighbour.columns = {static_cast<double>(u), static_cast<double>(v)};
                    for (const Plane* feature : input.features) {
                        neighbour.columns.push_back((*feature)[neighbour.pixel]);
                    }
                    window.push_back(std::move(neighbour));
                }
            }
            const std::size_t n = 2 + input.features.size();
            double total = 0;
            Row mean(n, 0);
            for (const Neighbour& j : window) {
                total += j.weight;
                for (std::size_t a = 0; a < n; ++a) {
                    mean[a] += j.weight * j.columns[a];
                }
            }
            for (double& value : mean) {
                value /= total;
            }
            std::vector<Row> matrix(n, Row(n, 0));
            for (const Neighbour& j : window) {
                for (std::size_t a = 0; a < n; ++a) {
                    for (std::size_t b = 0; b < n; ++b) {
                        matrix[a][b] +=
                            j.weight * (j.columns[a] - mean[a]) * (j.columns[b] - mean[b]);
                    }
                }
            }
            for (std::size_t a = 0; a < n; ++a) {
                matrix[a][a] += ridge * matrix[a][a] + kConstantVariance * total;
            }
            for (std::size_t c = 0; c < 3; ++c) {
                double color = 0;
                for (const Neighbour& j : window) {
                    color += j.weight * (*input.color[c])[j.pixel] / total;
                }
                Row right(n, 0);
                for (const Neighbour& j : window) {
                    for (std::size_t a = 0; a < n; ++a) {
                        right[a] += j.weight * (j.columns[a] - mean[a]) *
                                    ((*input.color[c])[j.pixel] - color);
                    }
                }
                const Row slope = SolveLinear(matrix, right);
                for (const Neighbour& j : window) {
                    double value = color;
                    for (std::size_t a = 0; a < n; ++a) {
                        value += slope[a] * (j.columns[a] - mean[a]);
                    }
                    sums[c][j.pixel] += j.weight * value;
                }
            }
            for (const Neighbour& j : window) {
                sums[3][j.pixel] += j.weight;
            }
        }
    }
    std::array<Plane, 3> out;
    for (std::size_t c = 0; c < 3; ++c) {
        for (std::size_t i = 0; i < pixels; ++i) {
            out[c].push_back(static_cast<float>(sums[c][i] / sums[3][i]));
        }
    }
    return out;
}

}  // namespace relume::denoise
