#pragma once

#include <vector>

#include "core/film/film.h"

namespace relume::jobs {

// What counts of samples should be in proportion to when a filter follows (methods 5.5), row-major
// over the window: its square over a pixel's count is about the filtered pixel's relative variance.
// `disagreement` is the Guide's of this film, `noise` its RelativeDeviation.
//
// Where the two filtered halves differ is where samples change the filtered image. Differences of
// single pixels say little: they are averaged over 21x21 pixels, and scaled by the samples that
// are there, since a pixel of few differs more. A part of the noise stays in, so that what the
// filter wrongly agrees on is not starved.
std::vector<float> GuidedDeviation(const Film& film, const std::vector<float>& disagreement,
                                   const std::vector<float>& noise);

}  // namespace relume::jobs
