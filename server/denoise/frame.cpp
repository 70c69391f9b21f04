#include "server/denoise/frame.h"

#include <algorithm>

#include "server/denoise/frame_repair.h"
#include "server/denoise/seen_lights.h"

namespace relume::denoise {
namespace {

// Mean and sum of squared deviations of two halves put together (Chan et al. 1979).
struct Joined {
    double mean = 0, m2 = 0;
};

Joined Join(double na, double mean_a, double m2_a, double nb, double mean_b, double m2_b) {
    const double n = na + nb;
    if (n == 0) {
        return {};
    }
    const double delta = mean_b - mean_a;
    return {(na * mean_a + nb * mean_b) / n, m2_a + m2_b + delta * delta * na * nb / n};
}

Plane ToPlane(std::span<const float> values) { return {values.begin(), values.end()}; }

// Means of the halves; a half without samples gets its neighbours'.
void ReadHalves(const Film& film, Frame* frame) {
    for (int h = 0; h < 2; ++h) {
        const auto count = film.Plane(kCountA + h);
        const auto fill = [&](Plane* plane, std::span<const float> mean) {
            *plane = ToPlane(mean);
            Holes holes(plane->size());
            for (std::size_t i = 0; i < plane->size(); ++i) {
                holes[i] = count[i] == 0 || !IsUsable(mean[i]);
            }
            FillHoles(frame->width, frame->height, holes, {plane}, {});
        };
        for (int c = 0; c < 3; ++c) {
            fill(&frame->half[h][c], film.Plane((h == 0 ? kMeanA : kMeanB) + c));
        }
        for (int f = 0; f < kFeatureCount; ++f) {
            fill(&frame->feature_half[h][f],
                 film.Plane((h == 0 ? kFeatureMeanA : kFeatureMeanB) + f));
        }
    }
}

// Means, variances and flags. The joint variance of both halves has n - 1 degrees of freedom, so
// that two samples are enough for it. `both` is 1 where both halves have samples.
void ReadColor(const Film& film, const Plane& both, Frame* frame) {
    const int width = frame->width, height = frame->height;
    const std::size_t pixels = frame->pixel_count();
    const auto count_a = film.Plane(kCountA), count_b = film.Plane(kCountB);
    Plane halves_variance[3];
    for (int c = 0; c < 3; ++c) {
        const auto mean_a = film.Plane(kMeanA + c), mean_b = film.Plane(kMeanB + c);
        const auto m2_a = film.Plane(kM2A + c), m2_b = film.Plane(kM2B + c);
        for (Plane* plane : {&frame->color[c], &frame->sample_variance[c], &halves_variance[c]}) {
            plane->resize(pixels);
        }
        for (std::size_t i = 0; i < pixels; ++i) {
            const double n = frame->count[i];
            const Joined joined =
                Join(count_a[i], mean_a[i], m2_a[i], count_b[i], mean_b[i], m2_b[i]);
            frame->color[c][i] = static_cast<float>(joined.mean);
            frame->sample_variance[c][i] = static_cast<float>(n > 1 ? joined.m2 / (n - 1) : 0);
            const double delta = mean_a[i] - static_cast<double>(mean_b[i]);
            halves_variance[c][i] =
                static_cast<float>(n > 0 ? delta * delta * count_a[i] * count_b[i] / (n * n) : 0);
            frame->flagged[i] |= n == 0 || !IsUsable(frame->color[c][i]) ||
                                 !IsUsable(frame->sample_variance[c][i]) ||
                                 !IsUsable(halves_variance[c][i]);
        }
    }
    FillHoles(width, height, frame->flagged, {&frame->color[0], &frame->color[1], &frame->color[2]},
              {});

    Plane freedom(pixels), known = both;
    for (std::size_t i = 0; i < pixels; ++i) {
        freedom[i] = frame->flagged[i] != 0 ? 0 : std::max(frame->count[i] - 1, 0.0f);
        known[i] = frame->flagged[i] != 0 ? 0 : both[i];
    }
    for (int c = 0; c < 3; ++c) {
        Plane& variance = frame->sample_variance[c];
        if (PoolUnknown(width, height, freedom, &variance)) {
            for (std::size_t i = 0; i < pixels; ++i) {
                variance[i] /= std::max(frame->count[i], 1.0f);
            }
        } else {
            variance = LocalDifferenceVariance(width, height, frame->color[c]);
        }
        frame->variance[c] = variance;
    }
    // A light that the camera sees would give its surroundings the level of its own two halves.
    const std::vector<unsigned char> lights = FindSeenLights(*frame);
    for (std::size_t i = 0; i < lights.size(); ++i) {
        known[i] = lights[i] != 0 ? 0 : known[i];
    }
    for (int c = 0; c < 3; ++c) {
        Plane& variance = frame->sample_variance[c];
        frame->variance[c] = Regularise(width, height, variance, halves_variance[c], known);
        FillHoles(width, height, frame->flagged, {}, {&variance, &frame->variance[c]});
    }
}

void ReadFeatures(const Film& film, Frame* frame) {
    const std::size_t pixels = frame->pixel_count();
    const auto count_a = film.Plane(kCountA), count_b = film.Plane(kCountB);
    for (int f = 0; f < kFeatureCount; ++f) {
        const auto mean_a = film.Plane(kFeatureMeanA + f), mean_b = film.Plane(kFeatureMeanB + f);
        const auto m2 = film.Plane(kFeatureM2 + f);
        Plane& mean = frame->feature[f];
        Plane& variance = frame->feature_variance[f];
        mean.resize(pixels);
        variance.resize(pixels);
        Holes holes(pixels);
        Plane freedom(pixels);
        for (std::size_t i = 0; i < pixels; ++i) {
            const double n = frame->count[i];
            const Joined joined = Join(count_a[i], mean_a[i], 0, count_b[i], mean_b[i], 0);
            mean[i] = static_cast<float>(joined.mean);
            variance[i] = static_cast<float>(n > 1 ? m2[i] / (n - 1) : 0);
            holes[i] = n == 0 || !IsUsable(mean[i]) || !IsUsable(variance[i]);
            freedom[i] = holes[i] != 0 ? 0 : std::max(frame->count[i] - 1, 0.0f);
        }
        PoolUnknown(frame->width, frame->height, freedom, &variance);
        FillHoles(frame->width, frame->height, holes, {&mean}, {&variance});
    }
}

}  // namespace

Frame FrameFromFilm(const Film& film) {
    Frame frame;
    frame.width = film.width();
    frame.height = film.height();
    const std::size_t pixels = frame.pixel_count();
    const auto count_a = film.Plane(kCountA), count_b = film.Plane(kCountB);
    Plane both(pixels);
    frame.count.resize(pixels);
    frame.flagged.assign(pixels, 0);
    frame.samples = film.samples();
    frame.brightest = ToPlane(film.Plane(kMaxLuminance));
    for (std::size_t i = 0; i < pixels; ++i) {
        frame.count[i] = count_a[i] + count_b[i];
        both[i] = count_a[i] > 0 && count_b[i] > 0 ? 1.0f : 0.0f;
    }
    ReadColor(film, both, &frame);
    ReadFeatures(film, &frame);
    if (std::any_of(both.begin(), both.end(), [](float b) { return b > 0; })) {
        ReadHalves(film, &frame);
    }
    return frame;
}

}  // namespace relume::denoise
