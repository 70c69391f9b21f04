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
#include "server/denoise/network/plan_memory.h"
#include "server/denoise/network/step_weights.h"

namespace relume::denoise {

// Part of an image that a plan is run on: `inner` is what counts.
struct PlanTile {
    int x, y;              // of the tile's first pixel in the image
    int inner_x, inner_y;  // in the image
    int inner_width, inner_height;
};

// A graph made ready for inputs of one size. Each step goes over its pixels in blocks, or in groups
// of Winograd's tiles, which threads take one by one. Tensors lie in memory by row, group of
// channels (convolution.h), column, channel of the group.
class Plan {
  public:
    // `width`, `height`: multiples of the graph's alignment. `weights`: PrepareWeights of
    // the graph. Both must outlive it.
    Plan(const Graph& graph, const std::vector<StepWeights>& weights, int width, int height);
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
        const WinogradWeights* winograd = nullptr;
    };
    struct Block {
        int x, y, columns, rows;  // of the step's pixels
    };
    // Where the result goes.
    struct Target {
        int image_width;
        const PlanTile* tile;
        std::vector<Plane>* outputs;
    };
    // What a thread needs for a block: what it reads, its result, and oneDNN's own; for tiles: two
    // times 36 matrices.
    struct Scratch {
        std::vector<float> input, result, convolution;
        PlanBuffer matrices;
    };
    // A Scratch, given back in the end, so that who comes later need not touch fresh memory.
    class Borrowed {
      public:
        explicit Borrowed(Plan* plan);
        ~Borrowed();
        Borrowed(const Borrowed&) = delete;
        Borrowed& operator=(const Borrowed&) = delete;

        Scratch* operator->() const { return scratch_.get(); }

      private:
        Plan* plan_;
        std::unique_ptr<Scratch> scratch_;
    };
    // Winograd's tiles that a thread takes at a time: their matrices stay in its cache, and are
    // high enough for the weights, which are read once for all of them.
    static constexpr int kTiles = 24;

    Step PlanStep(const GraphStep& step, const StepWeights& weights) const;
    void RunStep(std::size_t s, const Target& target, const CancelToken& cancel);
    void RunChain(const PlanChain& chain, const Target& target, const CancelToken& cancel);
    int Groups(int tensor) const;
    float* Pixel(int tensor, int y, int group, int x) const;
    void ReadInput(std::span<const float* const> inputs, int image_width, int image_height,
                   const PlanTile& tile) const;
    void RunBlock(std::size_t s, const Block& block, const Target& target);
    void Gather(const GraphStep& step, const Block& block, std::vector<float>* to) const;
    void Store(const GraphStep& step, const Block& block, const float* result) const;
    void StorePooled(const GraphStep& step, const Block& block, const float* result) const;
    void StoreOutput(const Block& block, const float* result, const Target& target) const;

    // plan_winograd.cpp
    std::ptrdiff_t RowFloats(int tensor) const;
    std::size_t MatrixFloats(const Step& step) const;
    void RunTiles(std::size_t s, int first, int count, const Target& target);
    void ReadTiles(std::size_t s, int first, int count, float* to) const;
    void TransformBorder(const float* const* rows, const std::ptrdiff_t* columns, int x0, int y0,
                         int width, int height, float* to, std::ptrdiff_t step) const;
    void StoreTiles(std::size_t s, int first, int count, const float* sums,
                    const Target& target) const;
    void StoreOutputLine(const Block& line, int group, const float* result,
                         const Target& target) const;

    const Graph& graph_;
    int width_, height_;
    std::size_t lanes_;
    const WinogradKernels* kernels_;  // null: none
    PlanMemory memory_;
    std::vector<PlanBuffer> buffers_;
    std::vector<Step> steps_;
    std::size_t matrix_floats_ = 0;  // of a Scratch
    mutable std::mutex mutex_;
    std::vector<std::unique_ptr<Scratch>> scratch_;  // under mutex_: not in use
};

}  // namespace relume::denoise
