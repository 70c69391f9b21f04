#pragma once

#include <cstddef>
#include <memory>
#include <mutex>
#include <optional>
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

struct FreeBuffer {
    void operator()(float* buffer) const;
};
using PlanBuffer = std::unique_ptr<float[], FreeBuffer>;
// Of any content; on large pages, as there are hundreds of megabytes to be touched a first time.
PlanBuffer AllocateBuffer(std::size_t floats);

// Part of an image that a plan is run on: `inner` is what counts.
struct PlanTile {
    int x, y;              // of the tile's first pixel in the image
    int inner_x, inner_y;  // in the image
    int inner_width, inner_height;
};

// The weights of a graph's steps, filled up with zeros to whole groups of channels. By step; empty
// where it has no kernel. The graph's own are gone then: nobody else needs them.
std::vector<std::optional<ConvolutionWeights>> FillUpWeights(Graph* graph);

// A graph made ready for inputs of one size. Each step goes over its pixels in blocks, which
// threads take one by one. Tensors lie in memory by row, group of channels (convolution.h), column,
// channel of the group.
class Plan {
  public:
    // `width`, `height`: multiples of the graph's alignment. The graph must outlive it. `weights`:
    // FillUpWeights of it.
    Plan(const Graph& graph, const std::vector<std::optional<ConvolutionWeights>>& weights,
         int width, int height);
    ~Plan();
    Plan(const Plan&) = delete;
    Plan& operator=(const Plan&) = delete;

    // Reads the tile from planes of image_width x image_height, with zeros beyond their sides, and
    // writes what counts to `outputs` of the same size.
    void Run(std::span<const float* const> inputs, int image_width, int image_height,
             const PlanTile& tile, std::vector<Plane>* outputs, const CancelToken& cancel);

    int width() const { return width_; }
    int height() const { return height_; }
    // What it holds between runs, weights excepted.
    std::size_t bytes() const;

  private:
    struct Step {
        int width = 0, height = 0;              // before pooling
        int block_columns = 0, block_rows = 0;  // of all blocks but the last of a row or column
        int inputs = 0, outputs = 0;            // channels, filled up
        // For whole blocks, for those of the last column, row, and the last: [2 * last row + last
        // column]; empty where there is no such.
        std::unique_ptr<BlockConvolution> convolutions[4];
    };
    struct Block {
        int x, y, columns, rows;  // of the step's pixels
    };
    // What a thread needs for a block: what it reads, its result, and oneDNN's own.
    struct Scratch {
        std::vector<float> input, result, convolution;
    };
    class Borrowed;  // a Scratch

    Step PlanStep(const GraphStep& step, const ConvolutionWeights* weights) const;
    int Groups(int tensor) const;
    float* Pixel(int tensor, int y, int group, int x) const;
    void ReadInput(std::span<const float* const> inputs, int image_width, int image_height,
                   const PlanTile& tile) const;
    void RunBlock(std::size_t s, const Block& block, int image_width, const PlanTile& tile,
                  std::vector<Plane>* outputs);
    void Gather(const GraphStep& step, const Block& block, std::vector<float>* to) const;
    void Store(const GraphStep& step, const Block& block, const float* result) const;
    void StorePooled(const GraphStep& step, const Block& block, const float* result) const;
    void StoreOutput(const Block& block, const float* result, int image_width, const PlanTile& tile,
                     std::vector<Plane>* outputs) const;

    const Graph& graph_;
    int width_, height_;
    std::size_t lanes_;
    PlanMemory memory_;
    std::vector<PlanBuffer> buffers_;
    std::vector<Step> steps_;
    mutable std::mutex mutex_;
    std::vector<std::unique_ptr<Scratch>> scratch_;  // under mutex_: not in use
};

}  // namespace relume::denoise
