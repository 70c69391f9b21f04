#include "core/image/metrics.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>

#include "core/base/error.h"
#include "core/image/flip.h"
#include "core/image/separable.h"
#include "core/image/srgb.h"
#include "core/image/ssim.h"

namespace relume {
namespace {

using Rgb = std::array<Plane, 3>;

constexpr double kTrimmedShare = 0.001;

// The three channels, with black where one of them is not finite; adds those pixels to `bad`.
Rgb CleanRgb(const Image& image, const std::string& layer, const char* which, std::int64_t* bad) {
    Rgb rgb;
    for (std::size_t c = 0; c < 3; ++c) {
        const std::string channel = (layer.empty() ? "" : layer + ".") + "RGB"[c];
        if (!image.Has(channel)) {
            ThrowInvalidArgument(fmt::format("the {} has no channel '{}'; it has {}", which,
                                             channel, fmt::join(image.channels(), ", ")));
        }
        const auto plane = image.Plane(channel);
        rgb[c].assign(plane.begin(), plane.end());
    }
    for (std::size_t i = 0; i < image.pixel_count(); ++i) {
        if (!std::isfinite(rgb[0][i]) || !std::isfinite(rgb[1][i]) || !std::isfinite(rgb[2][i])) {
            rgb[0][i] = rgb[1][i] = rgb[2][i] = 0;
            ++*bad;
        }
    }
    return rgb;
}

Rgb Map(Rgb rgb, double (*f)(double)) {
    for (auto& plane : rgb) {
        std::transform(plane.begin(), plane.end(), plane.begin(), f);
    }
    return rgb;
}

double Mean(const Plane& values) {
    double sum = 0;
    for (const double value : values) {
        sum += value;
    }
    return sum / static_cast<double>(values.size());
}

// Per pixel, averaged over the channels.
Plane RelativeSquaredError(const Rgb& reference, const Rgb& test, double epsilon) {
    Plane error(reference[0].size(), 0.0);
    for (std::size_t c = 0; c < 3; ++c) {
        for (std::size_t i = 0; i < error.size(); ++i) {
            const double r = reference[c][i], d = test[c][i] - r;
            error[i] += d * d / (r * r + epsilon) / 3;
        }
    }
    return error;
}

// Mean without the largest `share` of the values, their number rounded half to even.
double TrimmedMean(Plane values, double share) {
    const auto cut =
        static_cast<std::ptrdiff_t>(std::nearbyint(static_cast<double>(values.size()) * share));
    const auto end = values.end() - cut;
    if (cut > 0) {
        std::nth_element(values.begin(), end, values.end());
        values.erase(end, values.end());
    }
    return Mean(values);
}

Plane Luma(const Rgb& rgb) {
    Plane luma(rgb[0].size());
    for (std::size_t i = 0; i < luma.size(); ++i) {
        luma[i] = 0.2126 * rgb[0][i] + 0.7152 * rgb[1][i] + 0.0722 * rgb[2][i];
    }
    return luma;
}

double Psnr(const Rgb& a, const Rgb& b) {
    double sum = 0;
    for (std::size_t c = 0; c < 3; ++c) {
        for (std::size_t i = 0; i < a[c].size(); ++i) {
            sum += (a[c][i] - b[c][i]) * (a[c][i] - b[c][i]);
        }
    }
    const double mse = sum / (3.0 * static_cast<double>(a[0].size()));
    return mse > 0 ? -10 * std::log10(mse) : std::numeric_limits<double>::infinity();
}

}  // namespace

ImageError CompareImages(const Image& reference, const Image& test,
                         const std::string& reference_layer, const std::string& test_layer,
                         bool with_flip) {
    if (reference.width() != test.width() || reference.height() != test.height()) {
        ThrowInvalidArgument(
            fmt::format("sizes differ: reference {}x{}, test {}x{}; images of one size are needed",
                        reference.width(), reference.height(), test.width(), test.height()));
    }
    if (reference.pixel_count() == 0) {
        ThrowInvalidArgument("images without pixels can't be compared");
    }
    ImageError error;
    const Rgb ref = CleanRgb(reference, reference_layer, "reference", &error.bad);
    const Rgb img = CleanRgb(test, test_layer, "test image", &error.bad);
    for (std::size_t i = 0; i < img[0].size(); ++i) {
        error.negative += img[0][i] < 0 || img[1][i] < 0 || img[2][i] < 0;
    }
    Plane relative = RelativeSquaredError(ref, img, kMrSEEpsilon);
    error.mrse = Mean(relative);
    error.mrse_trimmed = TrimmedMean(std::move(relative), kTrimmedShare);
    error.relmse = Mean(RelativeSquaredError(ref, img, kRelMSEEpsilon));
    const Rgb ref_encoded = Map(ref, EncodeSrgb), img_encoded = Map(img, EncodeSrgb);
    error.ssim = MeanSsim(Luma(ref_encoded), Luma(img_encoded), reference.width());
    error.psnr = Psnr(ref_encoded, img_encoded);
    error.energy =
        (Mean(img[0]) + Mean(img[1]) + Mean(img[2])) / (Mean(ref[0]) + Mean(ref[1]) + Mean(ref[2]));
    if (with_flip) {
        const auto clamp = [](double x) { return std::clamp(x, 0.0, 1.0); };
        error.flip = MeanFlip(Map(ref, clamp), Map(img, clamp), reference.width());
    }
    return error;
}

}  // namespace relume
