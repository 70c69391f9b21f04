#include "server/denoise/output_image.h"

#include <algorithm>

#include "core/base/check.h"
#include "server/denoise/planes.h"

namespace relume::denoise {
namespace {

constexpr float kErrorBlur = 4;  // pixels

void AddPlane(const std::string& channel, const Plane& plane, Image* image) {
    RELUME_CHECK_EQ(plane.size(), image->pixel_count());
    std::ranges::copy(plane, image->Plane(image->Add(channel)).begin());
}

void AddRgb(const std::string& prefix, const Plane (&planes)[3], Image* image) {
    for (int c = 0; c < 3; ++c) {
        AddPlane(prefix + "RGB"[c], planes[c], image);
    }
}

// From a sample's variance to that of the mean; one sample where the count is not known.
Plane FeatureMeanVariance(const Frame& frame, int feature) {
    Plane variance = frame.feature_variance[feature];
    for (std::size_t i = 0; i < frame.count.size(); ++i) {
        variance[i] /= std::max(frame.count[i], 1.0f);
    }
    return variance;
}

}  // namespace

std::string FeatureNameWith(int feature, const std::string& suffix) {
    std::string name = FeatureName(feature);
    return name.insert(std::min(name.find('.'), name.size()), suffix);
}

Image AssembleLayers(const Frame& frame, const Result& result, const ErrorEstimate* error,
                     bool all_layers) {
    Image image(frame.width, frame.height);
    AddRgb("", result.color, &image);
    std::ranges::fill(image.Plane(image.Add("A")), 1.0f);
    AddRgb("noisy.", frame.color, &image);
    for (int f = 0; f < kFeatureCount; ++f) {
        if (!frame.feature[f].empty()) {
            AddPlane(FeatureName(f), frame.feature[f], &image);
        }
    }
    AddRgb("variance.", frame.variance, &image);
    if (!frame.count.empty()) {
        AddPlane("samples.Y", frame.count, &image);
    }
    if (error != nullptr) {
        Plane map = BlurGaussian(error->map, frame.width, frame.height, kErrorBlur);
        for (float& value : map) {
            value = std::max(value, 0.0f);
        }
        AddPlane("relmse.Y", map, &image);
    }
    if (!all_layers) {
        return image;
    }
    if (!frame.brightest.empty()) {
        AddPlane("brightest.Y", frame.brightest, &image);
    }
    if (frame.has_halves()) {
        AddRgb("buffer_a.", frame.half[0], &image);
        AddRgb("buffer_b.", frame.half[1], &image);
    }
    for (int f = 0; f < kFeatureCount; ++f) {
        if (!frame.feature_variance[f].empty()) {
            AddPlane(FeatureNameWith(f, "_variance"), FeatureMeanVariance(frame, f), &image);
        }
        if (!frame.feature_half[0][f].empty()) {
            AddPlane(FeatureNameWith(f, "_a"), frame.feature_half[0][f], &image);
            AddPlane(FeatureNameWith(f, "_b"), frame.feature_half[1][f], &image);
        }
    }
    return image;
}

Image AssembleOutput(const Film& film, const Frame& frame, const Result& result,
                     const ErrorEstimate* error, bool all_layers) {
    Image image = AssembleLayers(frame, result, error, all_layers);
    const TileRect& window = film.window();
    image.SetWindow(window.x0, window.y0, film.display_width(), film.display_height());
    return image;
}

}  // namespace relume::denoise
