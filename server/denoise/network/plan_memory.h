#pragma once

#include <cstddef>
#include <memory>
#include <vector>

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
// Of any content, aligned to vectors; large ones on large pages, as there are hundreds of megabytes
// to be touched a first time.
PlanBuffer AllocateBuffer(std::size_t floats);

}  // namespace relume::denoise
