#pragma once

#include <cstddef>
#include <memory>
#include <mutex>
#include <span>
#include <vector>

#include "core/base/cancel_token.h"
#include "server/denoise/frame.h"
#include "server/denoise/network/convolution.h"
#include "server/denoise/network/graph.h"

namespace relume::denoise {

// Numbers that a graph's tensors take at one time, with the buffers that they share.
struct PlanMemory {
    std::vector<int> buffer;         // of each tensor
    std::vector<std::size_t> sizes;  // of each buffer, floats
    std::size_t bytes() const;
};
// Of an input of width x height pixels, multiples of the graph's alignment.
PlanMemory LayOut(const Graph& graph, int width, int height);

// Part of an image that a plan is run on: `inner` is what counts.
struct PlanTile {
    int x, y;              // of the tile's first pixel in the image
    int inner_x, inner_y;  // in the image
    int inner_width, inner_height;
};

// A graph made ready for inputs of one size. Each step goes over its rows in bands, which threads
// take one by one.
class Plan {
  public:
    // `width`, `height`: multiples of the graph's alignment. The graph must outlive it.
    Plan(const Graph& graph, int width, int height);

    // Reads the tile from planes of image_width x image_height, with zeros beyond their sides, and
    // writes what counts to `outputs` of the same size.
    void Run(std::span<const float* const> inputs, int image_width, int image_height,
             const PlanTile& tile, std::vector<Plane>* outputs, const CancelToken& cancel);

  private:
    struct Step {
        int rows = 0, band = 0;  // before pooling; rows of a band but the last
        // For the bands of `band` rows, and for the last one if it has fewer.
        std::vector<BandConvolution> convolutions;
    };

    // What a thread needs for a band: its input, and its result before pooling or as output.
    struct Scratch {
        std::vector<float> input, result;
    };
    class Borrowed;  // a Scratch

    float* Row(int tensor, int y) const;
    void ClearBorder(int tensor) const;
    const float* Gather(const GraphStep& step, int y0, int y1, std::vector<float>* scratch) const;
    void RunBand(std::size_t s, int y0, int y1, int image_width, const PlanTile& tile,
                 std::vector<Plane>* outputs);
    void ReadInput(std::span<const float* const> inputs, int image_width, int image_height,
                   const PlanTile& tile);

    const Graph& graph_;
    int width_, height_;
    PlanMemory memory_;
    std::vector<std::unique_ptr<float[]>> buffers_;
    std::vector<Step> steps_;
    std::mutex mutex_;
    std::vector<std::unique_ptr<Scratch>> scratch_;  // under mutex_: not in use
};

}  // namespace relume::denoise
