#include "server/denoise/network/plan.h"

#include <algorithm>
#include <cstring>

#include "core/base/parallel.h"
#include "server/denoise/cancelled.h"

namespace relume::denoise {
namespace {

// Blocks are small enough for what they read and write to stay in the caches and for threads to end
// together, and large enough that what is around them costs little.
constexpr int kMostColumns = 512;
constexpr double kBlockProducts = 192e6;  // multiplications, before Winograd's savings
constexpr int kFewestRows = 8, kMostRows = 64;

int RoundUp(int value, int to) { return (value + to - 1) / to * to; }

}  // namespace

Plan::Plan(const Graph& graph, const std::vector<StepWeights>& weights, int width, int height)
    : graph_(graph),
      width_(width),
      height_(height),
      lanes_(static_cast<std::size_t>(ChannelLanes())),
      kernels_(FindWinogradKernels(VectorLanes())),
      memory_(LayOut(graph, width, height)) {
    for (const std::size_t size : memory_.sizes) {
        buffers_.push_back(BorrowBuffer(size));
    }
    for (std::size_t s = 0; s < weights.size(); ++s) {
        steps_.push_back(PlanStep(graph.steps[s], weights[s]));
        matrix_floats_ = std::max(matrix_floats_, MatrixFloats(steps_.back()));
    }
}

// The lock is for ThreadSanitizer, which does not see that the threads' work is done by now.
Plan::~Plan() {
    const std::lock_guard lock(mutex_);
    scratch_.clear();
}

Plan::Step Plan::PlanStep(const GraphStep& step, const StepWeights& weights) const {
    Step planned;
    planned.width = width_ >> step.scale;
    planned.height = height_ >> step.scale;
    if (weights.winograd) {
        planned.winograd = &*weights.winograd;
        return planned;
    }
    planned.inputs = FilledInputs(graph_, step);
    planned.outputs = weights.convolution ? FilledOutputs(step) : planned.inputs;

    // Sides of blocks are even, as pooling takes two.
    const int columns = (planned.width + kMostColumns - 1) / kMostColumns;
    planned.block_columns =
        std::min(RoundUp((planned.width + columns - 1) / columns, 4), planned.width);
    const double products = static_cast<double>(planned.block_columns) * planned.inputs *
                            std::max(1, planned.outputs * step.kernel * step.kernel);
    const int rows =
        static_cast<int>(std::clamp<double>(kBlockProducts / products, kFewestRows, kMostRows));
    planned.block_rows = std::min(rows / 4 * 4, planned.height);

    if (weights.convolution) {
        const int last_columns = planned.width % planned.block_columns;
        const int last_rows = planned.height % planned.block_rows;
        for (const int kind : {0, 1, 2, 3}) {
            const ConvolutionShape shape = {planned.inputs,
                                            planned.outputs,
                                            step.kernel,
                                            kind / 2 == 0 ? planned.block_rows : last_rows,
                                            kind % 2 == 0 ? planned.block_columns : last_columns,
                                            step.relu};
            if (shape.rows > 0 && shape.columns > 0) {
                planned.convolutions[kind] =
                    std::make_unique<BlockConvolution>(shape, *weights.convolution);
            }
        }
    }
    return planned;
}

std::size_t Plan::bytes() const {
    const std::lock_guard lock(mutex_);
    std::size_t bytes = memory_.bytes();
    for (const auto& scratch : scratch_) {
        bytes += (scratch->input.capacity() + scratch->result.capacity() +
                  scratch->convolution.capacity()) *
                 sizeof(float);
        bytes += scratch->matrices ? matrix_floats_ * sizeof(float) : 0;
    }
    return bytes;
}

int Plan::Groups(int tensor) const { return GroupsOf(graph_, tensor); }

float* Plan::Pixel(int tensor, int y, int group, int x) const {
    const auto t = static_cast<std::size_t>(tensor);
    const int width = width_ >> graph_.tensors[t].scale;
    const std::size_t row =
        static_cast<std::size_t>(y % memory_.rows[t]) * static_cast<std::size_t>(Groups(tensor)) +
        static_cast<std::size_t>(group);
    return buffers_[static_cast<std::size_t>(memory_.buffer[t])].get() +
           (row * static_cast<std::size_t>(width) + static_cast<std::size_t>(x)) * lanes_;
}

void Plan::ReadInput(std::span<const float* const> inputs, int image_width, int image_height,
                     const PlanTile& tile) const {
    const int in_image = std::clamp(image_width - tile.x, 0, width_);
    const auto width = static_cast<std::size_t>(width_);
    ParallelFor(0, static_cast<std::size_t>(height_), 8, [&](std::size_t begin, std::size_t end) {
        for (auto y = static_cast<int>(begin); y < static_cast<int>(end); ++y) {
            std::fill_n(Pixel(0, y, 0, 0), static_cast<std::size_t>(Groups(0)) * width * lanes_,
                        0.0f);
            if (tile.y + y >= image_height) {
                continue;
            }
            const std::size_t first =
                static_cast<std::size_t>(tile.y + y) * static_cast<std::size_t>(image_width) +
                static_cast<std::size_t>(tile.x);
            for (std::size_t c = 0; c < inputs.size(); ++c) {
                float* to = Pixel(0, y, static_cast<int>(c / lanes_), 0) + c % lanes_;
                for (std::size_t x = 0; x < static_cast<std::size_t>(in_image); ++x) {
                    to[x * lanes_] = inputs[c][first + x];
                }
            }
        }
    });
}

// What the step reads for a block, with the kernel's reach around it: sources side by side, zeros
// beyond the image.
void Plan::Gather(const GraphStep& step, const Block& block, std::vector<float>* input) const {
    const int side = step.kernel / 2;
    const int width = width_ >> step.scale, height = height_ >> step.scale;
    const int left = block.x - side, right = block.x + block.columns + side;
    const int x0 = std::max(left, 0), x1 = std::min(right, width);
    std::size_t groups = 0;
    for (const GraphSource& source : step.sources) {
        groups += static_cast<std::size_t>(Groups(source.tensor));
    }
    const std::size_t row = static_cast<std::size_t>(right - left) * lanes_;
    const std::size_t size = groups * static_cast<std::size_t>(block.rows + 2 * side) * row;
    if (input->size() < size) {
        input->resize(size);
    }
    float* to = input->data();
    for (const GraphSource& source : step.sources) {
        for (int group = 0; group < Groups(source.tensor); ++group) {
            for (int y = block.y - side; y < block.y + block.rows + side; ++y, to += row) {
                if (y < 0 || y >= height) {
                    std::fill_n(to, row, 0.0f);
                    continue;
                }
                float* at = std::fill_n(to, static_cast<std::size_t>(x0 - left) * lanes_, 0.0f);
                const float* from = Pixel(source.tensor, y >> source.up, group, 0);
                if (source.up == 0) {
                    const auto count = static_cast<std::size_t>(x1 - x0) * lanes_;
                    at = std::copy_n(from + static_cast<std::size_t>(x0) * lanes_, count, at);
                } else {
                    for (int x = x0; x < x1; ++x, at += lanes_) {
                        std::memcpy(at, from + static_cast<std::size_t>(x >> source.up) * lanes_,
                                    lanes_ * sizeof(float));
                    }
                }
                std::fill_n(at, static_cast<std::size_t>(right - x1) * lanes_, 0.0f);
            }
        }
    }
}

void Plan::Store(const GraphStep& step, const Block& block, const float* result) const {
    const auto row = static_cast<std::size_t>(block.columns) * lanes_;
    for (int group = 0; group < Groups(step.tensor); ++group) {
        for (int y = block.y; y < block.y + block.rows; ++y, result += row) {
            std::copy_n(result, row, Pixel(step.tensor, y, group, block.x));
        }
    }
}

void Plan::StorePooled(const GraphStep& step, const Block& block, const float* result) const {
    const auto row = static_cast<std::size_t>(block.columns) * lanes_;
    for (int group = 0; group < Groups(step.tensor); ++group) {
        for (int y = block.y; y < block.y + block.rows; y += 2, result += 2 * row) {
            float* to = Pixel(step.tensor, y / 2, group, block.x / 2);
            for (std::size_t i = 0; i < row; i += 2 * lanes_, to += lanes_) {
                const float* above = result + i;
                const float* below = above + row;
                for (std::size_t c = 0; c < lanes_; ++c) {
                    to[c] = std::max(std::max(above[c], above[lanes_ + c]),
                                     std::max(below[c], below[lanes_ + c]));
                }
            }
        }
    }
}

void Plan::StoreOutput(const Block& block, const float* result, const Target& target) const {
    const PlanTile& tile = *target.tile;
    const auto row = static_cast<std::size_t>(block.columns) * lanes_;
    const int x0 = std::max(block.x, tile.inner_x - tile.x);
    const int x1 = std::min(block.x + block.columns, tile.inner_x + tile.inner_width - tile.x);
    const int y0 = std::max(block.y, tile.inner_y - tile.y);
    const int y1 = std::min(block.y + block.rows, tile.inner_y + tile.inner_height - tile.y);
    for (std::size_t c = 0; c < target.outputs->size(); ++c) {
        const float* group =
            result + c / lanes_ * static_cast<std::size_t>(block.rows) * row + c % lanes_;
        for (int y = y0; y < y1; ++y) {
            const float* from = group + static_cast<std::size_t>(y - block.y) * row;
            float* to = (*target.outputs)[c].data() +
                        static_cast<std::size_t>(tile.y + y) *
                            static_cast<std::size_t>(target.image_width) +
                        static_cast<std::size_t>(tile.x);
            for (int x = x0; x < x1; ++x) {
                to[x] = from[static_cast<std::size_t>(x - block.x) * lanes_];
            }
        }
    }
}

Plan::Borrowed::Borrowed(Plan* plan) : plan_(plan) {
    {
        const std::lock_guard lock(plan_->mutex_);
        if (!plan_->scratch_.empty()) {
            scratch_ = std::move(plan_->scratch_.back());
            plan_->scratch_.pop_back();
            return;
        }
    }
    scratch_ = std::make_unique<Scratch>();
    if (plan_->matrix_floats_ > 0) {
        scratch_->matrices = BorrowBuffer(plan_->matrix_floats_);
    }
}

Plan::Borrowed::~Borrowed() {
    const std::lock_guard lock(plan_->mutex_);
    plan_->scratch_.push_back(std::move(scratch_));
}

void Plan::RunBlock(std::size_t s, const Block& block, const Target& target) {
    const GraphStep& step = graph_.steps[s];
    const Step& planned = steps_[s];
    const Borrowed scratch(this);
    Gather(step, block, &scratch->input);
    const float* result = scratch->input.data();
    if (step.kernel > 0) {
        const std::size_t size = static_cast<std::size_t>(block.rows * block.columns) *
                                 static_cast<std::size_t>(planned.outputs);
        if (scratch->result.size() < size) {
            scratch->result.resize(size);
        }
        const int kind = 2 * (block.rows < planned.block_rows ? 1 : 0) +
                         (block.columns < planned.block_columns ? 1 : 0);
        planned.convolutions[kind]->Run(scratch->input.data(), scratch->result.data(),
                                        &scratch->convolution);
        result = scratch->result.data();
    }
    if (step.tensor < 0) {
        StoreOutput(block, result, target);
    } else if (step.pool) {
        StorePooled(step, block, result);
    } else {
        Store(step, block, result);
    }
}

void Plan::RunStep(std::size_t s, const Target& target, const CancelToken& cancel) {
    const Step& step = steps_[s];
    const int columns = (step.width + step.block_columns - 1) / step.block_columns;
    const int rows = (step.height + step.block_rows - 1) / step.block_rows;
    ParallelFor(0, static_cast<std::size_t>(columns * rows), 1,
                [&](std::size_t begin, std::size_t end) {
                    for (auto b = static_cast<int>(begin); b < static_cast<int>(end); ++b) {
                        ThrowIfCancelled(cancel);
                        const int x = b % columns * step.block_columns;
                        const int y = b / columns * step.block_rows;
                        RunBlock(s,
                                 {x, y, std::min(step.block_columns, step.width - x),
                                  std::min(step.block_rows, step.height - y)},
                                 target);
                    }
                });
}

void Plan::Run(std::span<const float* const> inputs, int image_width, int image_height,
               const PlanTile& tile, std::vector<Plane>* outputs, const CancelToken& cancel) {
    ReadInput(inputs, image_width, image_height, tile);
    const Target target = {image_width, &tile, outputs};
    for (const PlanChain& chain : memory_.chains) {
        if (steps_[static_cast<std::size_t>(chain.first)].winograd != nullptr) {
            RunChain(chain, target, cancel);
        } else {
            RunStep(static_cast<std::size_t>(chain.first), target, cancel);
        }
    }
}

}  // namespace relume::denoise
