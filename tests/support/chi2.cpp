#include "tests/support/chi2.h"

#include <algorithm>
#include <cmath>
#include <numeric>
#include <random>
#include <vector>

namespace relume::test {
namespace {

// Upper regularised incomplete gamma function Q(a, x): series below a + 1, Lentz's continued
// fraction above.
double GammaQ(double a, double x) {
    if (x <= 0) {
        return 1;
    }
    const double front = std::exp(-x + a * std::log(x) - std::lgamma(a));
    if (x < a + 1) {
        double term = 1 / a, sum = term;
        for (int n = 1; n < 10000 && term > sum * 1e-15; ++n) {
            term *= x / (a + n);
            sum += term;
        }
        return 1 - front * sum;
    }
    double b = x + 1 - a, c = 1e300, d = 1 / b, h = d;
    for (int n = 1; n < 10000; ++n) {
        const double an = -n * (n - a);
        b += 2;
        d = 1 / (an * d + b);
        c = b + an / c;
        const double step = d * c;
        h *= step;
        if (std::abs(step - 1) < 1e-14) {
            break;
        }
    }
    return front * h;
}

// Integral of f over [x0,x1] x [y0,y1] by Gauss-Legendre on n x n parts with 4 points each way.
template <class F>
double Integrate(double x0, double x1, double y0, double y1, int n, F&& f) {
    constexpr double kNode[] = {-0.8611363115940526, -0.3399810435848563, 0.3399810435848563,
                                0.8611363115940526};
    constexpr double kWeight[] = {0.3478548451374538, 0.6521451548625461, 0.6521451548625461,
                                  0.3478548451374538};
    const double hx = (x1 - x0) / n, hy = (y1 - y0) / n;
    double sum = 0;
    for (int i = 0; i < n * 4; ++i) {
        for (int j = 0; j < n * 4; ++j) {
            const double x = x0 + hx * (i / 4 + 0.5 + 0.5 * kNode[i % 4]);
            const double y = y0 + hy * (j / 4 + 0.5 + 0.5 * kNode[j % 4]);
            sum += kWeight[i % 4] * kWeight[j % 4] * f(x, y);
        }
    }
    return sum * hx * hy / 4;
}

// Doubles the parts until the integral rests.
template <class F>
double IntegrateAdaptively(double x0, double x1, double y0, double y1, F&& f) {
    double last = Integrate(x0, x1, y0, y1, 1, f);
    for (int n = 2; n <= 16; n *= 2) {
        const double next = Integrate(x0, x1, y0, y1, n, f);
        if (std::abs(next - last) < 1e-4 * std::abs(next) + 1e-9) {
            return next;
        }
        last = next;
    }
    return last;
}

constexpr int kRows = 24, kColumns = 32;  // cells

}  // namespace

double ChiSquareTail(double x, int freedom) { return GammaQ(0.5 * freedom, 0.5 * x); }

double SignificanceOf(int tests) { return 1 - std::pow(1 - 1e-3, 1.0 / tests); }

double ChiSquareProbability(std::span<const double> observed, std::span<const double> expected) {
    std::vector<std::size_t> order(expected.size());
    std::iota(order.begin(), order.end(), std::size_t{0});
    std::sort(order.begin(), order.end(),
              [&](std::size_t a, std::size_t b) { return expected[a] < expected[b]; });
    double pooled_observed = 0, pooled_expected = 0, chi2 = 0;
    int cells = 0;
    for (const std::size_t i : order) {
        if (expected[i] < 5) {
            pooled_expected += expected[i];
            pooled_observed += observed[i];
            continue;
        }
        chi2 += (observed[i] - expected[i]) * (observed[i] - expected[i]) / expected[i];
        ++cells;
    }
    if (pooled_expected < 1e-4 && pooled_observed > 0) {
        return 0;
    }
    if (pooled_expected >= 5) {
        chi2 += (pooled_observed - pooled_expected) * (pooled_observed - pooled_expected) /
                pooled_expected;
        ++cells;
    } else if (pooled_observed > pooled_expected + 6 * std::sqrt(pooled_expected) + 6) {
        return 0;  // too few expected for chi-square, and far too many came
    }
    return cells > 1 ? ChiSquareTail(chi2, cells - 1) : 0;
}

double TestSphereSampler(const SphereSampler& sampler, int samples) {
    // Cells of equal size in (cos theta, phi); the last one is for "no sample".
    std::vector<double> observed(kRows * kColumns + 1), expected(kRows * kColumns + 1);
    std::mt19937 random(20240229);
    std::uniform_real_distribution<float> uniform(0, 1);
    const auto number = [&] { return std::min(uniform(random), 0x1.fffffep-1f); };
    for (int i = 0; i < samples; ++i) {
        const Vec2f u{number(), number()};
        Vec3f d;
        if (!sampler.sample(u, number(), &d)) {
            observed.back() += 1;
            continue;
        }
        double phi = std::atan2(d.y, d.x) / (2 * M_PI);
        phi -= std::floor(phi);
        const int row = std::clamp(static_cast<int>((d.z + 1) / 2 * kRows), 0, kRows - 1);
        const int column = std::clamp(static_cast<int>(phi * kColumns), 0, kColumns - 1);
        observed[static_cast<std::size_t>(row * kColumns + column)] += 1;
    }
    double total = 0;
    for (int row = 0; row < kRows; ++row) {
        for (int column = 0; column < kColumns; ++column) {
            const double p = IntegrateAdaptively(
                -1 + 2.0 * row / kRows, -1 + 2.0 * (row + 1) / kRows, 2 * M_PI * column / kColumns,
                2 * M_PI * (column + 1) / kColumns, [&](double z, double phi) {
                    const double r = std::sqrt(std::max(0.0, 1 - z * z));
                    return sampler.pdf({static_cast<float>(r * std::cos(phi)),
                                        static_cast<float>(r * std::sin(phi)),
                                        static_cast<float>(z)});
                });
            expected[static_cast<std::size_t>(row * kColumns + column)] = p * samples;
            total += p;
        }
    }
    if (total > 1.01) {
        return 0;  // not a density
    }
    expected.back() = std::max(0.0, 1 - total) * samples;
    // A density that integrates to 1 within rounding leaves nothing to expect for "no sample".
    if (expected.back() < 1e-3 * samples && observed.back() == 0) {
        expected.back() = 0;
    }
    return ChiSquareProbability(observed, expected);
}

double TestSquareSampler(const SquareSampler& sampler, int samples) {
    std::vector<double> observed(kRows * kColumns), expected(kRows * kColumns);
    std::mt19937 random(20240229);
    std::uniform_real_distribution<float> uniform(0, 1);
    for (int i = 0; i < samples; ++i) {
        const float a = std::min(uniform(random), 0x1.fffffep-1f);
        const Vec2f p = sampler.sample({a, std::min(uniform(random), 0x1.fffffep-1f)});
        const int row = std::clamp(static_cast<int>(p.y * kRows), 0, kRows - 1);
        const int column = std::clamp(static_cast<int>(p.x * kColumns), 0, kColumns - 1);
        observed[static_cast<std::size_t>(row * kColumns + column)] += 1;
    }
    for (int row = 0; row < kRows; ++row) {
        for (int column = 0; column < kColumns; ++column) {
            expected[static_cast<std::size_t>(row * kColumns + column)] =
                samples *
                Integrate(static_cast<double>(column) / kColumns,
                          static_cast<double>(column + 1) / kColumns,
                          static_cast<double>(row) / kRows, static_cast<double>(row + 1) / kRows, 8,
                          [&](double x, double y) {
                              return sampler.pdf({static_cast<float>(x), static_cast<float>(y)});
                          });
        }
    }
    return ChiSquareProbability(observed, expected);
}

}  // namespace relume::test
