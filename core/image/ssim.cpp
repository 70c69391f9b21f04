#include "core/image/ssim.h"

#include <array>
#include <cmath>
#include <limits>

namespace relume {
namespace {

constexpr int kRadius = 5;
constexpr double kSigma = 1.5;
constexpr double kC1 = 0.01 * 0.01;
constexpr double kC2 = 0.03 * 0.03;

std::array<double, 2 * kRadius + 1> Window() {
    std::array<double, 2 * kRadius + 1> g{};
    double sum = 0;
    for (int i = -kRadius; i <= kRadius; ++i) {
        sum += g[static_cast<std::size_t>(i + kRadius)] =
            std::exp(-0.5 * (i / kSigma) * (i / kSigma));
    }
    for (double& value : g) {
        value /= sum;
    }
    return g;
}

Plane Product(const Plane& a, const Plane& b) {
    Plane product(a.size());
    for (std::size_t i = 0; i < a.size(); ++i) {
        product[i] = a[i] * b[i];
    }
    return product;
}

}  // namespace

double MeanSsim(const Plane& a, const Plane& b, int width) {
    const int height = static_cast<int>(a.size()) / width;
    if (width < 2 * kRadius + 1 || height < 2 * kRadius + 1) {
        return std::numeric_limits<double>::quiet_NaN();
    }
    const auto window = Window();
    const auto blur = [&](const Plane& x) { return CorrelateSeparable(x, width, window, window); };
    const Plane mean_a = blur(a), mean_b = blur(b);
    const Plane square_a = blur(Product(a, a)), square_b = blur(Product(b, b));
    const Plane product = blur(Product(a, b));
    double sum = 0;
    for (int y = kRadius; y < height - kRadius; ++y) {
        for (int x = kRadius; x < width - kRadius; ++x) {
            const auto i = static_cast<std::size_t>(y) * static_cast<std::size_t>(width) +
                           static_cast<std::size_t>(x);
            const double ma = mean_a[i], mb = mean_b[i];
            const double variance = square_a[i] - ma * ma + square_b[i] - mb * mb;
            const double covariance = product[i] - ma * mb;
            sum += (2 * ma * mb + kC1) * (2 * covariance + kC2) /
                   ((ma * ma + mb * mb + kC1) * (variance + kC2));
        }
    }
    return sum / (static_cast<double>(width - 2 * kRadius) * (height - 2 * kRadius));
}

}  // namespace relume
