#include "server/denoise/output_image.h"

#include <algorithm>

#include "core/base/check.h"
#include "core/image/metrics.h"

namespace relume::denoise {
namespace {

void AddPlane(const std::string& channel, const Plane& plane, Image* image) {
    RELUME_CHECK_EQ(plane.size(), image->pixel_count());
    std::ranges::copy(plane, image->Plane(image->Add(channel)).begin());
}

void AddRgb(const std::string& prefix, const Plane (&planes)[3], Image* image) {
    for (int c = 0; c < 3; ++c) {
        AddPlane(prefix + "RGB"[c], planes[c], image);
    }
}

Plane NoisyRelMSE(const Frame& frame) {
    Plane relmse(frame.pixel_count());
    for (std::size_t i = 0; i < relmse.size(); ++i) {
        double sum = 0;
        for (int c = 0; c < 3; ++c) {
            const double value = frame.color[c][i];
            sum += frame.variance[c][i] / (value * value + kRelMSEEpsilon);
        }
        relmse[i] = static_cast<float>(sum / 3);
    }
    return relmse;
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

Image AssembleLayers(const Frame& frame, const Result& result, bool all_layers) {
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
    AddPlane("relmse.Y", NoisyRelMSE(frame), &image);
    if (!all_layers) {
        return image;
    }
    if (frame.has_halves()) {
        AddRgb("buffer_a.", frame.half[0], &image);
        AddRgb("buffer_b.", frame.half[1], &image);
    }
    for (int f = 0; f < kFeatureCount; ++f) {
        if (!frame.feature_variance[f].empty()) {
            AddPlane(FeatureNameWith(f, "_variance"), FeatureMeanVariance(frame, f), &image);
        }
    }
    return image;
}

Image AssembleOutput(const Film& film, const Frame& frame, const Result& result, bool all_layers) {
    Image image = AssembleLayers(frame, result, all_layers);
    const TileRect& window = film.window();
    image.SetWindow(window.x0, window.y0, film.display_width(), film.display_height());
    return image;
}

}  // namespace relume::denoise
