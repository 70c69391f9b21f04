#include "server/denoise/network/plan_memory.h"

#include <sys/mman.h>

#include <algorithm>
#include <cstdlib>
#include <new>

#include "server/denoise/network/convolution.h"

namespace relume::denoise {
namespace {

std::size_t Size(const GraphTensor& tensor, int width, int height) {
    const int lanes = ChannelLanes();
    return static_cast<std::size_t>(height >> tensor.scale) *
           static_cast<std::size_t>(width >> tensor.scale) *
           static_cast<std::size_t>((tensor.channels + lanes - 1) / lanes * lanes);
}

}  // namespace

void FreeBuffer::operator()(float* buffer) const { std::free(buffer); }

PlanBuffer AllocateBuffer(std::size_t floats) {
    constexpr std::size_t kPage = std::size_t{2} << 20, kVector = 64;
    const std::size_t unit = floats * sizeof(float) < kPage / 2 ? kVector : kPage;
    const std::size_t bytes = (floats * sizeof(float) + unit - 1) / unit * unit;
    void* buffer = std::aligned_alloc(unit, bytes);
    if (buffer == nullptr) {
        throw std::bad_alloc();
    }
    if (unit == kPage) {
        (void)madvise(buffer, bytes, MADV_HUGEPAGE);  // a wish: small pages do as well
    }
    return PlanBuffer(static_cast<float*>(buffer));
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
    std::vector<int> free;
    const auto give = [&](std::size_t tensor) {
        const std::size_t size = Size(graph.tensors[tensor], width, height);
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

}  // namespace relume::denoise
