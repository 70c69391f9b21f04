#include "server/denoise/network/plan_memory.h"

#include <sys/mman.h>

#include <algorithm>
#include <cstdlib>
#include <iterator>
#include <map>
#include <mutex>
#include <new>

#include "server/denoise/network/convolution.h"
#include "server/denoise/network/winograd_kernels.h"

namespace relume::denoise {
namespace {

constexpr std::size_t kPage = std::size_t{2} << 20;

std::size_t RoundUp(std::size_t value, std::size_t to) { return (value + to - 1) / to * to; }

float* Allocate(std::size_t bytes, std::size_t unit) {
    void* buffer = std::aligned_alloc(unit, bytes);
    if (buffer == nullptr) {
        throw std::bad_alloc();
    }
    if (unit == kPage) {
        (void)madvise(buffer, bytes, MADV_HUGEPAGE);  // a wish: small pages do as well
    }
    return static_cast<float*>(buffer);
}

// What nobody has borrowed at present.
class Pool {
  public:
    // The smallest that is large enough, unless it is more than twice as large; else null. Of
    // equal ones the last that was given back, which the caches may still have.
    float* Take(std::size_t* bytes) {
        const std::lock_guard lock(mutex_);
        auto found = free_.lower_bound(*bytes);
        if (found == free_.end() || found->first > 2 * *bytes) {
            return nullptr;
        }
        found = std::prev(free_.upper_bound(found->first));
        float* buffer = found->second;
        *bytes = found->first;
        bytes_ -= found->first;
        free_.erase(found);
        return buffer;
    }

    void Put(float* buffer, std::size_t bytes) {
        (void)madvise(buffer, bytes, MADV_FREE);  // a wish, too
        const std::lock_guard lock(mutex_);
        free_.emplace(bytes, buffer);
        bytes_ += bytes;
        // The largest first: small ones are what is asked for most often.
        while (bytes_ > kMostBytes) {
            const auto largest = std::prev(free_.end());
            bytes_ -= largest->first;
            std::free(largest->second);
            free_.erase(largest);
        }
    }

  private:
    static constexpr std::size_t kMostBytes = std::size_t{256} << 20;

    std::mutex mutex_;
    std::multimap<std::size_t, float*> free_;
    std::size_t bytes_ = 0;
};

// Never destroyed: networks that live as long as the process give back to it.
Pool& ThePool() {
    static Pool& pool = *new Pool;
    return pool;
}

constexpr int kTile = 4;          // Winograd's, pixels
constexpr int kBandTiles = 1280;  // of a band: enough for threads to end together

bool IsTiled(const GraphStep& step) {
    return step.kernel == 3 && FindWinogradKernels(VectorLanes()) != nullptr;
}

bool IsReadByNextAlone(const Graph& graph, std::size_t s) {
    if (s + 1 == graph.steps.size()) {
        return false;
    }
    const GraphStep& step = graph.steps[s];
    const GraphStep& next = graph.steps[s + 1];
    return IsTiled(step) && IsTiled(next) && !step.pool && step.scale == next.scale &&
           graph.tensors[static_cast<std::size_t>(step.tensor)].last_step ==
               static_cast<int>(s) + 1;
}

// The step that writes a tensor; -1: none, the network's input.
int Writer(const Graph& graph, std::size_t tensor) {
    const auto writer =
        std::ranges::find(graph.steps, static_cast<int>(tensor), &GraphStep::tensor);
    return writer == graph.steps.end() ? -1 : static_cast<int>(writer - graph.steps.begin());
}

std::size_t Size(const GraphTensor& tensor, int width, int rows) {
    const int lanes = ChannelLanes();
    return static_cast<std::size_t>(rows) * static_cast<std::size_t>(width >> tensor.scale) *
           static_cast<std::size_t>((tensor.channels + lanes - 1) / lanes * lanes);
}

}  // namespace

void FreeBuffer::operator()(float* buffer) const {
    if (kept > 0) {
        ThePool().Put(buffer, kept);
    } else {
        std::free(buffer);
    }
}

PlanBuffer AllocateBuffer(std::size_t floats) {
    const std::size_t bytes = floats * sizeof(float);
    const std::size_t unit = bytes < kPage / 2 ? 64 : kPage;
    return {Allocate(RoundUp(bytes, unit), unit), FreeBuffer{}};
}

PlanBuffer BorrowBuffer(std::size_t floats) {
    std::size_t bytes = RoundUp(floats * sizeof(float), kPage);
    float* buffer = ThePool().Take(&bytes);
    if (buffer == nullptr) {
        buffer = Allocate(bytes, kPage);
    }
    return {buffer, FreeBuffer{bytes}};
}

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
    for (const GraphTensor& tensor : graph.tensors) {
        memory.rows.push_back(height >> tensor.scale);
    }
    for (std::size_t s = 0; s < graph.steps.size(); ++s) {
        const GraphStep& step = graph.steps[s];
        const int tile_columns = ((width >> step.scale) + kTile - 1) / kTile;
        const int tile_rows = ((height >> step.scale) + kTile - 1) / kTile;
        const int band = (kBandTiles + tile_columns - 1) / tile_columns;
        const auto first = static_cast<int>(s);
        while (IsReadByNextAlone(graph, s)) {
            // The band that is written, the one that is read, and a row of tiles on either side.
            int& rows = memory.rows[static_cast<std::size_t>(graph.steps[s].tensor)];
            rows = std::min(rows, (2 * band + 2) * kTile);
            ++s;
        }
        const auto last = static_cast<int>(s);
        memory.chains.push_back({first, last, band < tile_rows ? band : tile_rows + last - first});
    }
    std::vector<int> free;
    const auto give = [&](std::size_t tensor) {
        const std::size_t size = Size(graph.tensors[tensor], width, memory.rows[tensor]);
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
    for (const PlanChain& chain : memory.chains) {
        for (int s = chain.first; s <= chain.last; ++s) {
            const int tensor = graph.steps[static_cast<std::size_t>(s)].tensor;
            if (tensor >= 0) {
                give(static_cast<std::size_t>(tensor));
            }
        }
        for (std::size_t t = 0; t < graph.tensors.size(); ++t) {
            const int last = graph.tensors[t].last_step;
            const int end = last < 0 ? Writer(graph, t) : last;
            if (end >= chain.first && end <= chain.last) {
                free.push_back(memory.buffer[t]);
            }
        }
    }
    return memory;
}

}  // namespace relume::denoise
