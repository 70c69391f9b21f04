#pragma once

#include <functional>
#include <span>

#include "core/base/cancel_token.h"
#include "server/denoise/nlm_weights.h"

namespace relume::denoise {

// Calls body(weights, tile) for tiles that cover the image, on several threads, each with an
// NlmWeights of its own that was loaded with the tile. Throws kCancelled soon after `cancel` is
// set.
void ForEachNlmTile(const NlmGuide& guide, const NlmOptions& options, int radius,
                    const NlmKernels& kernels, const CancelToken& cancel,
                    const std::function<void(NlmWeights&, const TileRect&)>& body);

// *out[k] = weighted mean of *in[k] over the (2 radius + 1)^2 window, clipped at the border; the
// pixel itself has weight 1. All inputs get the same weights. They may be the guide's planes or
// others of its size; outputs are made, and are no inputs. `variance_share`, if not null, becomes
// sum of w^2 / (sum of w)^2: how much of the variance of one pixel is left where all have the same.
// Throws kCancelled soon after `cancel` is set.
void FilterNlm(const NlmGuide& guide, const NlmOptions& options, int radius,
               std::span<const Plane* const> in, std::span<Plane* const> out,
               const CancelToken& cancel, const NlmKernels& kernels = BestNlmKernels(),
               Plane* variance_share = nullptr);

}  // namespace relume::denoise
