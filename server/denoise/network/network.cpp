#include "server/denoise/network/network.h"

#include <fmt/format.h>

#include <algorithm>
#include <iterator>
#include <list>
#include <map>
#include <mutex>
#include <utility>

#include "core/base/error.h"
#include "server/denoise/network/graph.h"
#include "server/denoise/network/plan.h"

namespace relume::denoise {
namespace {

int RoundUp(int value, int to) { return (value + to - 1) / to * to; }

// The image in columns x rows tiles.
struct Tiling {
    int columns, rows;
    int inner_width, inner_height;  // multiples of the alignment
    int width, height;              // of the largest tile, halos included
};

Tiling Divide(const Graph& graph, int width, int height, int columns, int rows) {
    const auto side = [&](int size, int tiles, int* inner) {
        const int padded = RoundUp(size, graph.alignment);
        *inner = RoundUp((padded + tiles - 1) / tiles, graph.alignment);
        const int halo = RoundUp(graph.halo, graph.alignment);
        return std::min(padded, *inner + std::min(tiles - 1, 2) * halo);
    };
    Tiling t = {columns, rows};
    t.width = side(width, columns, &t.inner_width);
    t.height = side(height, rows, &t.inner_height);
    return t;
}

// The least work of tiles that fit the memory, by the size alone; the least memory if none do.
Tiling ChooseTiling(const Graph& graph, int width, int height, std::size_t most_bytes) {
    const int most_columns = RoundUp(width, graph.alignment) / graph.alignment;
    const int most_rows = RoundUp(height, graph.alignment) / graph.alignment;
    Tiling best = {};
    double least_work = 0;
    std::size_t least_bytes = 0;
    for (int columns = 1, rows = 0; columns <= most_columns && rows != 1; ++columns) {
        Tiling tiling = {};
        std::size_t bytes = 0;
        for (rows = 1; rows <= most_rows; ++rows) {
            tiling = Divide(graph, width, height, columns, rows);
            bytes = std::max(LayOut(graph, tiling.width, tiling.height).bytes(), most_bytes);
            if (bytes == most_bytes) {
                break;
            }
        }
        const double work =
            static_cast<double>(tiling.width) * tiling.height * tiling.columns * tiling.rows;
        if (best.columns == 0 || bytes < least_bytes ||
            (bytes == least_bytes && work < least_work)) {
            best = tiling;
            least_work = work;
            least_bytes = bytes;
        }
    }
    return best;
}

}  // namespace

// Plans of small images are kept, for the next of the same size: making one takes as long as
// running it on some ten thousand pixels.
struct Network::Impl {
    static constexpr std::size_t kMostKept = std::size_t{48} << 20;  // bytes in all

    explicit Impl(Graph lowered) : weights(PrepareWeights(&lowered)), graph(std::move(lowered)) {}

    std::unique_ptr<Plan> TakePlan(int width, int height) const {
        {
            const std::lock_guard lock(mutex);
            const auto kept = std::ranges::find_if(plans, [&](const std::unique_ptr<Plan>& plan) {
                return plan->width() == width && plan->height() == height;
            });
            if (kept != plans.end()) {
                std::unique_ptr<Plan> plan = std::move(*kept);
                plans.erase(kept);
                return plan;
            }
        }
        return std::make_unique<Plan>(graph, weights, width, height);
    }

    void Keep(std::unique_ptr<Plan> plan) const {
        std::size_t bytes = plan->bytes();
        if (bytes > kMostKept) {
            return;
        }
        const std::lock_guard lock(mutex);
        plans.push_front(std::move(plan));
        for (auto kept = std::next(plans.begin()); kept != plans.end();) {
            bytes += (*kept)->bytes();
            kept = bytes > kMostKept ? plans.erase(kept) : std::next(kept);
        }
    }

    const std::vector<StepWeights> weights;
    const Graph graph;
    mutable std::mutex mutex;
    mutable std::list<std::unique_ptr<Plan>> plans;  // under mutex: not in use, the last one first
};

Network::Network(const GraphSpec& graph, const TensorArchive& weights, const std::string& source)
    : impl_(std::make_unique<Impl>(LowerGraph(graph, weights, source))) {}

Network::~Network() = default;
Network::Network(Network&&) noexcept = default;
Network& Network::operator=(Network&&) noexcept = default;

int Network::input_channels() const { return impl_->graph.tensors.front().channels; }
int Network::output_channels() const { return impl_->graph.steps.back().outputs; }
int Network::alignment() const { return impl_->graph.alignment; }
int Network::halo() const { return impl_->graph.halo; }

std::vector<Plane> Network::Run(std::span<const float* const> inputs, int width, int height,
                                const CancelToken& cancel, std::size_t most_bytes) const {
    const Graph& graph = impl_->graph;
    if (static_cast<int>(inputs.size()) != input_channels()) {
        throw Error(ErrorCode::kInternal, fmt::format("a network of {} inputs was given {}",
                                                      input_channels(), inputs.size()));
    }
    const std::size_t pixels = static_cast<std::size_t>(width) * static_cast<std::size_t>(height);
    std::vector<Plane> outputs(static_cast<std::size_t>(output_channels()), Plane(pixels));
    if (pixels == 0) {
        return outputs;
    }
    const Tiling tiling = ChooseTiling(graph, width, height, most_bytes);
    const int halo = RoundUp(graph.halo, graph.alignment);
    // Tiles of the same size share a plan; sorted so that only one is there at a time.
    std::map<std::pair<int, int>, std::vector<PlanTile>> by_size;
    for (int y = 0; y < height; y += tiling.inner_height) {
        for (int x = 0; x < width; x += tiling.inner_width) {
            const int x0 = std::max(0, x - halo), y0 = std::max(0, y - halo);
            const int x1 = std::min(RoundUp(width, graph.alignment), x + tiling.inner_width + halo);
            const int y1 =
                std::min(RoundUp(height, graph.alignment), y + tiling.inner_height + halo);
            by_size[{x1 - x0, y1 - y0}].push_back({x0, y0, x, y,
                                                   std::min(tiling.inner_width, width - x),
                                                   std::min(tiling.inner_height, height - y)});
        }
    }
    for (const auto& [size, tiles] : by_size) {
        std::unique_ptr<Plan> plan = impl_->TakePlan(size.first, size.second);
        for (const PlanTile& tile : tiles) {
            plan->Run(inputs, width, height, tile, &outputs, cancel);
        }
        impl_->Keep(std::move(plan));
    }
    return outputs;
}

}  // namespace relume::denoise
