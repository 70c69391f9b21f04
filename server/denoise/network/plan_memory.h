#pragma once

#include <cstddef>
#include <memory>
#include <vector>

#include "server/denoise/network/graph.h"

namespace relume::denoise {

// Steps that are run together, in bands of rows of tiles, as each reads the one before and nobody
// else does: of what is between them only the rows at hand are kept.
struct PlanChain {
    int first, last;  // steps
    int band;         // rows of Winograd's tiles
};

// Numbers that a graph's tensors take at one time, with the buffers that they share.
struct PlanMemory {
    std::vector<PlanChain> chains;   // of all steps in order, most of one step
    std::vector<int> rows;           // kept of each tensor: row y lies at y modulo this
    std::vector<int> buffer;         // of each tensor
    std::vector<std::size_t> sizes;  // of each buffer, floats
    std::size_t bytes() const;
};
// Of an input of width x height pixels, multiples of the graph's alignment.
PlanMemory LayOut(const Graph& graph, int width, int height);

struct FreeBuffer {
    std::size_t kept = 0;  // bytes, of one that is lent; else 0
    void operator()(float* buffer) const;
};
using PlanBuffer = std::unique_ptr<float[], FreeBuffer>;
// Of any content, aligned to vectors; large ones on large pages.
PlanBuffer AllocateBuffer(std::size_t floats);
// The same for a while: what is given back is lent again, as to touch fresh memory takes as long as
// the work. The system may take up to 256 MiB of it back when it is short of memory; more is given
// back at once. Thread-safe.
PlanBuffer BorrowBuffer(std::size_t floats);

}  // namespace relume::denoise
