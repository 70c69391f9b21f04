#include "server/denoise/network/plan.h"

#include <algorithm>
#include <cstring>

#include "core/base/parallel.h"
#include "server/denoise/cancelled.h"

namespace relume::denoise {
namespace {

// Multiplications of a band, about: two milliseconds, so that threads end together and a cancelled
// run ends soon; and enough rows that those around it cost little.
constexpr double kBandProducts = 128e6;
constexpr int kFewestRows = 4;

std::size_t Size(const Graph& graph, std::size_t tensor, int width, int height) {
    const GraphTensor& t = graph.tensors[tensor];
    return static_cast<std::size_t>((height >> t.scale) + 2 * t.border) *
           static_cast<std::size_t>(width >> t.scale) * static_cast<std::size_t>(t.channels);
}

// Rows of a step's bands: even, as pooling takes two.
int BandRows(const GraphStep& step, int width, int rows) {
    const double products = static_cast<double>(width >> step.scale) * step.inputs *
                            std::max(1, step.outputs * step.kernel * step.kernel);
    const int wanted = static_cast<int>(std::min(kBandProducts / products, 1e6)) / 2 * 2;
    return std::min(std::max(wanted, kFewestRows), rows);
}

}  // namespace

std::size_t PlanMemory::bytes() const {
    std::size_t sum = 0;
    for (const std::size_t size : sizes) {
        sum += size * sizeof(float);
    }
    return sum;
}

PlanMemory LayOut(const Graph& graph, int width, int height) {
    PlanMemory memory;
    memory.buffer.assign(graph.tensors.size(), -1);
    std::vector<int> free;
    const auto give = [&](std::size_t tensor) {
        const std::size_t size = Size(graph, tensor, width, height);
        // The smallest that is large enough, else the largest.
        auto best = free.end();
        for (auto f = free.begin(); f != free.end(); ++f) {
            const std::size_t has = memory.sizes[static_cast<std::size_t>(*f)];
            const std::size_t of_best =
                best == free.end() ? 0 : memory.sizes[static_cast<std::size_t>(*best)];
            if (best == free.end() ||
                (has >= size ? of_best < size || has < of_best : of_best < size && has > of_best)) {
                best = f;
            }
        }
        if (best == free.end()) {
            memory.buffer[tensor] = static_cast<int>(memory.sizes.size());
            memory.sizes.push_back(size);
            return;
        }
        memory.buffer[tensor] = *best;
        std::size_t& has = memory.sizes[static_cast<std::size_t>(*best)];
        has = std::max(has, size);
        free.erase(best);
    };
    give(0);
    for (std::size_t s = 0; s < graph.steps.size(); ++s) {
        if (graph.steps[s].tensor >= 0) {
            give(static_cast<std::size_t>(graph.steps[s].tensor));
        }
        for (std::size_t t = 0; t < graph.tensors.size(); ++t) {
            const bool unread =
                graph.steps[s].tensor == static_cast<int>(t) && graph.tensors[t].last_step < 0;
            if (graph.tensors[t].last_step == static_cast<int>(s) || unread) {
                free.push_back(memory.buffer[t]);
            }
        }
    }
    return memory;
}

Plan::Plan(const Graph& graph, int width, int height)
    : graph_(graph), width_(width), height_(height), memory_(LayOut(graph, width, height)) {
    for (const std::size_t size : memory_.sizes) {
        buffers_.push_back(std::make_unique_for_overwrite<float[]>(size));
    }
    for (const GraphStep& step : graph.steps) {
        Step& planned = steps_.emplace_back();
        planned.rows = height >> step.scale;
        planned.band = BandRows(step, width, planned.rows);
        if (step.kernel == 0) {
            continue;
        }
        ConvolutionShape shape = {step.inputs,         step.outputs, step.kernel,
                                  width >> step.scale, planned.band, step.relu};
        planned.convolutions.emplace_back(shape, step.weights, step.bias);
        shape.rows = planned.rows % planned.band;
        if (shape.rows > 0) {
            planned.convolutions.emplace_back(shape, step.weights, step.bias);
        }
    }
}

float* Plan::Row(int tensor, int y) const {
    const GraphTensor& t = graph_.tensors[static_cast<std::size_t>(tensor)];
    float* data =
        buffers_[static_cast<std::size_t>(memory_.buffer[static_cast<std::size_t>(tensor)])].get();
    return data + static_cast<std::size_t>(y + t.border) *
                      static_cast<std::size_t>(width_ >> t.scale) *
                      static_cast<std::size_t>(t.channels);
}

void Plan::ClearBorder(int tensor) const {
    const GraphTensor& t = graph_.tensors[static_cast<std::size_t>(tensor)];
    float* above = Row(tensor, -t.border);
    float* below = Row(tensor, height_ >> t.scale);
    const auto size = static_cast<std::size_t>(Row(tensor, 0) - above);
    std::fill_n(above, size, 0.0f);
    std::fill_n(below, size, 0.0f);
}

// Rows y0 to y1 of a step's sources side by side, zeros beyond the image.
const float* Plan::Gather(const GraphStep& step, int y0, int y1,
                          std::vector<float>* scratch) const {
    const auto width = static_cast<std::size_t>(width_ >> step.scale);
    const int height = height_ >> step.scale;
    const auto stride = static_cast<std::size_t>(step.inputs);
    scratch->resize(static_cast<std::size_t>(y1 - y0) * width * stride);
    std::size_t offset = 0;
    for (const GraphSource& source : step.sources) {
        const auto channels = static_cast<std::size_t>(
            graph_.tensors[static_cast<std::size_t>(source.tensor)].channels);
        const std::size_t bytes = channels * sizeof(float);
        for (int y = y0; y < y1; ++y) {
            float* to =
                scratch->data() + static_cast<std::size_t>(y - y0) * width * stride + offset;
            if (y < 0 || y >= height) {
                for (std::size_t x = 0; x < width; ++x) {
                    std::memset(to + x * stride, 0, bytes);
                }
                continue;
            }
            const float* from = Row(source.tensor, y >> source.up);
            for (std::size_t x = 0; x < width; ++x) {
                std::memcpy(to + x * stride, from + (x >> source.up) * channels, bytes);
            }
        }
        offset += channels;
    }
    return scratch->data();
}

void Plan::ReadInput(std::span<const float* const> inputs, int image_width, int image_height,
                     const PlanTile& tile) {
    const std::size_t channels = inputs.size();
    ClearBorder(0);
    const int in_image = std::clamp(image_width - tile.x, 0, width_);
    ParallelFor(0, static_cast<std::size_t>(height_), 8, [&](std::size_t begin, std::size_t end) {
        for (auto y = static_cast<int>(begin); y < static_cast<int>(end); ++y) {
            float* to = Row(0, y);
            std::fill_n(to, static_cast<std::size_t>(width_) * channels, 0.0f);
            if (tile.y + y >= image_height) {
                continue;
            }
            const std::size_t first =
                static_cast<std::size_t>(tile.y + y) * static_cast<std::size_t>(image_width) +
                static_cast<std::size_t>(tile.x);
            for (std::size_t c = 0; c < channels; ++c) {
                for (int x = 0; x < in_image; ++x) {
                    to[static_cast<std::size_t>(x) * channels + c] =
                        inputs[c][first + static_cast<std::size_t>(x)];
                }
            }
        }
    });
}

// Given back in the end, so that a thread that comes later need not touch fresh memory.
class Plan::Borrowed {
  public:
    explicit Borrowed(Plan* plan) : plan_(plan) {
        const std::lock_guard lock(plan_->mutex_);
        if (plan_->scratch_.empty()) {
            scratch_ = std::make_unique<Scratch>();
        } else {
            scratch_ = std::move(plan_->scratch_.back());
            plan_->scratch_.pop_back();
        }
    }
    ~Borrowed() {
        const std::lock_guard lock(plan_->mutex_);
        plan_->scratch_.push_back(std::move(scratch_));
    }
    Borrowed(const Borrowed&) = delete;
    Borrowed& operator=(const Borrowed&) = delete;

    Scratch* operator->() const { return scratch_.get(); }

  private:
    Plan* plan_;
    std::unique_ptr<Scratch> scratch_;
};

void Plan::RunBand(std::size_t s, int y0, int y1, int image_width, const PlanTile& tile,
                   std::vector<Plane>* outputs) {
    const GraphStep& step = graph_.steps[s];
    const Step& planned = steps_[s];
    const Borrowed scratch(this);
    const auto width = static_cast<std::size_t>(width_ >> step.scale);
    const auto channels = static_cast<std::size_t>(step.outputs);

    // Input: a tensor's own rows, if they lie as they are needed.
    const int side = step.kernel / 2;
    const bool plain = step.sources.size() == 1 && step.sources.front().up == 0;
    const float* from = plain ? Row(step.sources.front().tensor, y0 - side)
                              : Gather(step, y0 - side, y1 + side, &scratch->input);

    // Convolution.
    const bool direct = !step.pool && step.tensor >= 0;
    const float* result = from;
    if (step.kernel > 0) {
        float* to = nullptr;
        if (direct) {
            to = Row(step.tensor, y0);
        } else {
            scratch->result.resize(static_cast<std::size_t>(y1 - y0) * width * channels);
            to = scratch->result.data();
        }
        planned.convolutions[y1 - y0 == planned.band ? 0 : 1].Run(from, to);
        result = to;
    }

    // Pooling.
    if (step.pool) {
        for (int y = y0; y < y1; y += 2) {
            const float* above = result + static_cast<std::size_t>(y - y0) * width * channels;
            const float* below = above + width * channels;
            float* to = Row(step.tensor, y / 2);
            for (std::size_t x = 0; x < width; x += 2) {
                for (std::size_t c = 0; c < channels; ++c) {
                    const std::size_t left = x * channels + c, right = left + channels;
                    to[x / 2 * channels + c] = std::max(std::max(above[left], above[right]),
                                                        std::max(below[left], below[right]));
                }
            }
        }
    }

    // Output.
    if (step.tensor < 0) {
        const int first = std::max(y0, tile.inner_y - tile.y);
        const int last = std::min(y1, tile.inner_y + tile.inner_height - tile.y);
        for (int y = first; y < last; ++y) {
            const float* row = result + (static_cast<std::size_t>(y - y0) * width +
                                         static_cast<std::size_t>(tile.inner_x - tile.x)) *
                                            channels;
            const std::size_t to =
                static_cast<std::size_t>(tile.y + y) * static_cast<std::size_t>(image_width) +
                static_cast<std::size_t>(tile.inner_x);
            for (std::size_t c = 0; c < channels; ++c) {
                for (std::size_t x = 0; x < static_cast<std::size_t>(tile.inner_width); ++x) {
                    (*outputs)[c][to + x] = row[x * channels + c];
                }
            }
        }
    }
}

void Plan::Run(std::span<const float* const> inputs, int image_width, int image_height,
               const PlanTile& tile, std::vector<Plane>* outputs, const CancelToken& cancel) {
    ReadInput(inputs, image_width, image_height, tile);
    for (std::size_t s = 0; s < steps_.size(); ++s) {
        if (graph_.steps[s].tensor >= 0) {
            ClearBorder(graph_.steps[s].tensor);
        }
        const int rows = steps_[s].rows, band = steps_[s].band;
        ParallelFor(0, static_cast<std::size_t>((rows + band - 1) / band), 1,
                    [&](std::size_t begin, std::size_t end) {
                        for (auto b = static_cast<int>(begin); b < static_cast<int>(end); ++b) {
                            ThrowIfCancelled(cancel);
                            RunBand(s, b * band, std::min(rows, (b + 1) * band), image_width, tile,
                                    outputs);
                        }
                    });
    }
}

}  // namespace relume::denoise
