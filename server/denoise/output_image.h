#pragma once

#include <string>

#include "core/film/film.h"
#include "core/image/image.h"
#include "server/denoise/denoiser.h"
#include "server/denoise/error_estimate.h"

namespace relume::denoise {

// The layers of an image file, of those that the frame has:
//   R G B A            the filtered image; A = 1: nothing here knows coverage
//   noisy.RGB          mean of the samples; a pixel without any holds its neighbours' mean
//   albedo.RGB N.XYZ Z visibility.Y   features, means
//   variance.RGB       of noisy
//   samples.Y          finite samples a pixel
//   relmse.Y           estimated relative squared error of R G B, mean over RGB, epsilon 0.01,
//                      smoothed by a Gaussian of 4 pixels; if there is an estimate
// and with `all_layers`
//   buffer_a.RGB buffer_b.RGB         means of the halves
//   albedo_variance.RGB N_variance.XYZ Z_variance visibility_variance.Y   of the features' means
//   albedo_a.RGB albedo_b.RGB ...      means of the features' halves
// The image's data window is its display window.
Image AssembleLayers(const Frame& frame, const Result& result, const ErrorEstimate* error,
                     bool all_layers);

// The same in the film's windows.
Image AssembleOutput(const Film& film, const Frame& frame, const Result& result,
                     const ErrorEstimate* error, bool all_layers);

// "albedo_variance.R", "Z_variance": a feature's channel with `suffix` after its layer.
std::string FeatureNameWith(int feature, const std::string& suffix);

}  // namespace relume::denoise
