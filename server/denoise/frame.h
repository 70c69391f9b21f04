#pragma once

#include <memory>
#include <vector>

#include "core/film/aov.h"
#include "core/film/film.h"
#include "core/image/image.h"
#include "server/denoise/sampling.h"

namespace relume::denoise {

using Plane = std::vector<float>;  // width x height, row-major

// What filters see of a frame: planes taken from a film or from an EXR, sanitised: a pixel without
// finite value holds the mean of its finite 3x3 neighbours, the largest of their variances, and is
// flagged.
struct Frame {
    int width = 0, height = 0;
    Plane color[3];     // mean radiance of all samples
    Plane variance[3];  // variance of that mean (regularised where halves are there: methods 1.2)
    Plane sample_variance[3];  // of the mean, from the samples' own variance alone
    Plane half[2][3];          // means of the halves; empty if the source has none
    Plane count;               // finite samples; empty if not known
    Plane brightest;  // luminance of the brightest sample, without directly seen emission; or empty
    Plane feature[kFeatureCount];           // means; empty if the source lacks the feature
    Plane feature_variance[kFeatureCount];  // of one sample; empty or as feature
    Plane feature_half[2][kFeatureCount];   // means of the halves; empty or as feature
    // The samples themselves: null if they were not kept. Parts and shrunk copies of a frame don't
    // have them.
    std::shared_ptr<const SampleRecords> samples;
    Sampling sampling;
    std::vector<unsigned char> flagged;  // 1: was not finite, or had no sample

    std::size_t pixel_count() const { return static_cast<std::size_t>(width) * height; }
    bool has_halves() const { return !half[0][0].empty(); }
};

Frame FrameFromFilm(const Film& film);

// From the layers that Relume writes (noisy.*, variance.*, albedo.*, N.*, Z, buffer_a.*,
// buffer_b.*, ...) or other renderers' names for them (channel_names.cpp); plain R G B is the noisy
// image if there is no `noisy`. `variance` is what the file says, else the best that can be had
// from the samples' variance, the halves, or neighbouring pixels; a depth of 1e9 or more, a miss,
// becomes the largest below. `sampling` is taken from Relume's metadata. What was missing or
// repaired is said in `notes` (may be null); no colour or no pixel throws
// kInvalidArgument.
Frame FrameFromImage(const Image& image, std::vector<std::string>* notes);

}  // namespace relume::denoise
