#include "core/image/flip.h"

#include <algorithm>
#include <cmath>
#include <vector>

#include "core/base/parallel.h"

namespace relume {
namespace {

using Color = std::array<double, 3>;
using Planes = std::array<Plane, 3>;

constexpr double kPi = 3.14159265358979323846;
constexpr double kPixelsPerDegree = 67.0206;
constexpr double kColorExponent = 0.7;    // q_c
constexpr double kFeatureExponent = 0.5;  // q_f
constexpr double kKnee = 0.4;             // p_c
constexpr double kKneeError = 0.95;       // p_t
constexpr std::size_t kPixelsPerTask = 4096;

// ---- Colour spaces. XYZ is of linear sRGB, relative to its white.

constexpr double kRgbToXyz[3][3] = {
    {10135552.0 / 24577794, 8788810.0 / 24577794, 4435075.0 / 24577794},
    {2613072.0 / 12288897, 8788810.0 / 12288897, 887015.0 / 12288897},
    {1425312.0 / 73733382, 8788810.0 / 73733382, 70074185.0 / 73733382}};

Color Multiply(const double (&m)[3][3], const Color& v) {
    return {m[0][0] * v[0] + m[0][1] * v[1] + m[0][2] * v[2],
            m[1][0] * v[0] + m[1][1] * v[1] + m[1][2] * v[2],
            m[2][0] * v[0] + m[2][1] * v[1] + m[2][2] * v[2]};
}

Color White() { return Multiply(kRgbToXyz, {1, 1, 1}); }

struct Matrix {
    double m[3][3];
};

// Inverse of kRgbToXyz by cofactors.
Matrix XyzToRgb() {
    const auto& a = kRgbToXyz;
    const auto minor = [&](int r, int c) {
        const int r1 = (r + 1) % 3, r2 = (r + 2) % 3, c1 = (c + 1) % 3, c2 = (c + 2) % 3;
        return a[r1][c1] * a[r2][c2] - a[r1][c2] * a[r2][c1];
    };
    const double det = a[0][0] * minor(0, 0) + a[0][1] * minor(0, 1) + a[0][2] * minor(0, 2);
    Matrix inverse{};
    for (int r = 0; r < 3; ++r) {
        for (int c = 0; c < 3; ++c) {
            inverse.m[r][c] = minor(c, r) / det;
        }
    }
    return inverse;
}

Color ToWhiteXyz(const Color& rgb) {
    static const Color white = White();
    const Color xyz = Multiply(kRgbToXyz, rgb);
    return {xyz[0] / white[0], xyz[1] / white[1], xyz[2] / white[2]};
}

Color ToYCxCz(const Color& rgb) {
    const Color xyz = ToWhiteXyz(rgb);
    return {116 * xyz[1] - 16, 500 * (xyz[0] - xyz[1]), 200 * (xyz[1] - xyz[2])};
}

// Clamped to the RGB cube.
Color FromYCxCz(const Color& ycc) {
    static const Color white = White();
    static const Matrix to_rgb = XyzToRgb();
    const double y = (ycc[0] + 16) / 116;
    Color rgb = Multiply(
        to_rgb.m, {(y + ycc[1] / 500) * white[0], y * white[1], (y - ycc[2] / 200) * white[2]});
    for (double& value : rgb) {
        value = std::clamp(value, 0.0, 1.0);
    }
    return rgb;
}

// CIELAB with the chroma scaled by the lightness (Hunt effect).
Color ToHuntLab(const Color& rgb) {
    constexpr double kDelta = 6.0 / 29;
    Color f = ToWhiteXyz(rgb);
    for (double& t : f) {
        t = t > kDelta * kDelta * kDelta ? std::cbrt(t) : t / (3 * kDelta * kDelta) + 4.0 / 29;
    }
    const double lightness = 116 * f[1] - 16;
    return {lightness, 0.01 * lightness * 500 * (f[0] - f[1]),
            0.01 * lightness * 200 * (f[1] - f[2])};
}

double HyAb(const Color& a, const Color& b) {
    return std::abs(a[0] - b[0]) + std::hypot(a[1] - b[1], a[2] - b[2]);
}

// ---- Contrast sensitivity (section 4.1.1): a sum of Gaussians a sqrt(pi/b) exp(-pi^2 d^2 / b),
// d in degrees, each of which is separable.

struct Gaussian {
    double a, b;
};

Plane FilterBySensitivity(const Plane& in, int width, const std::vector<Gaussian>& terms) {
    // Three standard deviations of the widest Gaussian of all channels, b = 0.04.
    const int radius =
        static_cast<int>(std::ceil(3 * std::sqrt(0.04 / (2 * kPi * kPi)) * kPixelsPerDegree));
    Plane out(in.size(), 0.0);
    double total = 0;
    for (const auto& term : terms) {
        std::vector<double> kernel;
        double sum = 0;
        for (int i = -radius; i <= radius; ++i) {
            const double d = i / kPixelsPerDegree;
            sum += kernel.emplace_back(std::exp(-kPi * kPi * d * d / term.b));
        }
        const double weight = term.a * std::sqrt(kPi / term.b);
        total += weight * sum * sum;
        const Plane part = CorrelateSeparable(in, width, kernel, kernel);
        for (std::size_t i = 0; i < out.size(); ++i) {
            out[i] += weight * part[i];
        }
    }
    for (double& value : out) {
        value /= total;
    }
    return out;
}

// ---- Edges and points (section 4.2): first and second derivatives of a Gaussian on luminance.

Plane FeatureMagnitude(const Plane& y, int width, bool points) {
    const double sd = 0.5 * 0.082 * kPixelsPerDegree;
    const int radius = static_cast<int>(std::ceil(3 * sd));
    std::vector<double> smooth, derivative;
    double sum = 0, positive = 0, negative = 0;
    for (int x = -radius; x <= radius; ++x) {
        const double g = std::exp(-x * x / (2 * sd * sd));
        const double d = g * (points ? x * x / (sd * sd) - 1 : -x);
        smooth.push_back(g);
        derivative.push_back(d);
        sum += g;
        (d > 0 ? positive : negative) += d;
    }
    for (std::size_t i = 0; i < smooth.size(); ++i) {
        smooth[i] /= sum;
        derivative[i] /= derivative[i] > 0 ? positive : -negative;
    }
    Plane magnitude = CorrelateSeparable(y, width, derivative, smooth);
    const Plane vertical = CorrelateSeparable(y, width, smooth, derivative);
    for (std::size_t i = 0; i < magnitude.size(); ++i) {
        magnitude[i] = std::hypot(magnitude[i], vertical[i]);
    }
    return magnitude;
}

// ---- One image, seen.

struct Seen {
    Planes lab;           // Hunt-adjusted CIELAB after the contrast sensitivity
    Plane edges, points;  // feature magnitudes
};

Seen See(const Planes& rgb, int width) {
    Planes ycc;
    Plane luminance(rgb[0].size());
    for (auto& plane : ycc) {
        plane.resize(rgb[0].size());
    }
    ParallelFor(0, luminance.size(), kPixelsPerTask, [&](std::size_t i0, std::size_t i1) {
        for (std::size_t i = i0; i < i1; ++i) {
            const Color color = ToYCxCz({rgb[0][i], rgb[1][i], rgb[2][i]});
            for (std::size_t c = 0; c < 3; ++c) {
                ycc[c][i] = color[c];
            }
            luminance[i] = (color[0] + 16) / 116;
        }
    });
    // Table 1 of the paper; terms of weight 0 are left out.
    Seen seen{{FilterBySensitivity(ycc[0], width, {{1, 0.0047}}),
               FilterBySensitivity(ycc[1], width, {{1, 0.0053}}),
               FilterBySensitivity(ycc[2], width, {{34.1, 0.04}, {13.5, 0.025}})},
              FeatureMagnitude(luminance, width, false),
              FeatureMagnitude(luminance, width, true)};
    ParallelFor(0, luminance.size(), kPixelsPerTask, [&](std::size_t i0, std::size_t i1) {
        for (std::size_t i = i0; i < i1; ++i) {
            const Color color =
                ToHuntLab(FromYCxCz({seen.lab[0][i], seen.lab[1][i], seen.lab[2][i]}));
            for (std::size_t c = 0; c < 3; ++c) {
                seen.lab[c][i] = color[c];
            }
        }
    });
    return seen;
}

}  // namespace

double MeanFlip(const std::array<Plane, 3>& reference, const std::array<Plane, 3>& test,
                int width) {
    const Seen a = See(reference, width), b = See(test, width);
    const double largest =
        std::pow(HyAb(ToHuntLab({0, 1, 0}), ToHuntLab({0, 0, 1})), kColorExponent);
    const double knee = kKnee * largest;
    Plane error(a.edges.size());
    ParallelFor(0, error.size(), kPixelsPerTask, [&](std::size_t i0, std::size_t i1) {
        for (std::size_t i = i0; i < i1; ++i) {
            const double distance = std::pow(HyAb({a.lab[0][i], a.lab[1][i], a.lab[2][i]},
                                                  {b.lab[0][i], b.lab[1][i], b.lab[2][i]}),
                                             kColorExponent);
            const double color =
                distance < knee
                    ? distance * kKneeError / knee
                    : kKneeError + (distance - knee) / (largest - knee) * (1 - kKneeError);
            const double difference =
                std::max(std::abs(a.edges[i] - b.edges[i]), std::abs(a.points[i] - b.points[i]));
            const double feature =
                std::pow(std::min(difference / std::sqrt(2.0), 1.0), kFeatureExponent);
            error[i] = std::pow(color, 1 - feature);
        }
    });
    double sum = 0;
    for (const double value : error) {
        sum += value;
    }
    return sum / static_cast<double>(error.size());
}

}  // namespace relume
