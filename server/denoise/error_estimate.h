#pragma once

#include <array>
#include <map>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "core/base/cancel_token.h"
#include "server/denoise/denoiser.h"
#include "server/denoise/frame.h"
#include "server/denoise/frame_parts.h"
#include "server/denoise/halves.h"

namespace relume::denoise {

// RelMSE (epsilon 0.01) of an image, estimated without a reference.
struct ErrorEstimate {
    double relmse = 0;
    double low = 0, high = 0;  // its 95 % interval
    double unfiltered = 0;     // the unfiltered image's, relative to the same brightness
    Plane map;                 // a pixel; unsmoothed: mostly noise, and may be negative
};

// Variance of the mean a pixel and channel, from the difference of the halves, if there are any:
// one degree of freedom, mostly noise in one pixel.
std::array<Plane, 3> VarianceByHalves(const Frame& frame);

// Squared brightness of the filtered image a pixel and channel: what its errors are relative to.
std::array<Plane, 3> FilteredYardstick(const FilteredHalves& halves, int width, int height);

// Of the unfiltered image, from its variance.
ErrorEstimate EstimateNoisy(const Frame& frame);

// Of the filtered one, without filtering the whole: by its halves, each filtered apart (halves.h).
// Of a large frame a part is filtered so, WindowsToJudge, and there is no map; `known` are those
// windows of which this was done before. Nothing if the frame has none, or the method can't do with
// one.
std::optional<ErrorEstimate> EstimateByHalves(const Denoiser& denoiser, const Frame& frame,
                                              const CancelToken& cancel,
                                              std::span<const WindowError> known = {});
std::vector<TileRect> WindowsToJudge(const Frame& frame);  // one, the whole, of a small frame

// What counts of one of them, by its halves, which are at hand.
WindowError JudgeWindow(const FramePart& part, const FilteredHalves& halves);

// Of the filtered one, by its halves, which are at hand.
ErrorEstimate JudgeHalves(const Frame& frame, const FilteredHalves& halves);

// Of what was chosen, for less than filtering halves by a dear filter: the estimate of
// `choice.base` on this frame times `over_base` (a ratio estimate: their errors vary together). Its
// `base_error` and `base_windows`, if it has any, must be this frame's. Nothing if nothing was
// tried.
std::optional<ErrorEstimate> EstimateChosen(const Choice& choice, const Frame& frame,
                                            const CancelToken& cancel);

// Of the filtered one: by its halves, else by SURE (Stein 1981; methods 1.5), if the method knows
// its derivative: that is too low where the method chooses by SURE itself. Else nothing.
std::optional<ErrorEstimate> EstimateFiltered(const Denoiser& denoiser, const Frame& frame,
                                              const Result& result, const CancelToken& cancel);

// Where the error of an estimate lies, if it has no map: by what the filter says itself.
void AddMap(const Frame& frame, const Result& result, ErrorEstimate* estimate);

// Writes metadata `key` and `key`_interval, "low high"; without an estimate both are erased.
void WriteClaim(const std::string& key, const ErrorEstimate* estimate,
                std::map<std::string, std::string>* metadata);

}  // namespace relume::denoise
