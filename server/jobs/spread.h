#pragma once

#include <cstddef>
#include <cstdint>
#include <functional>
#include <vector>

namespace relume::jobs {

// Deals `samples` out to `pixels` as evenly as packs of `pack` samples allow (2 keeps the halves
// equal). Which pixels get one pack more is fixed and scattered over the image. What does not fill
// a pack is left.
std::vector<std::uint32_t> SpreadEvenly(std::size_t pixels, std::uint64_t samples,
                                        std::uint32_t pack);

// Makes `counts` smaller in proportion, so that they sum to `samples` exactly. Parts of a sample go
// to the pixels that lack most of one, equal ones in the same scattered order.
void ScaleDown(std::uint64_t samples, std::vector<std::uint32_t>* counts);

// A first pass of `spp` samples a pixel, or as many of them as the budget has. Packs of two, but
// below two samples a pixel singles: no pixel is left out for another's pair.
std::vector<std::uint32_t> SpreadPilot(std::size_t pixels, std::uint32_t spp, std::uint64_t budget);

// Expected counts as whole pairs, rounded up or down by a number of the pixel's own and of `salt`,
// and brought to `samples` in all (one less if that is odd). All 0 if they round to nothing.
std::vector<std::uint32_t> RoundToPairs(std::size_t pixels,
                                        const std::function<double(std::size_t)>& expected,
                                        std::uint64_t samples, std::uint32_t salt);

}  // namespace relume::jobs
