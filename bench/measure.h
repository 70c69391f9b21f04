#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

#include "bench/embree_probe.h"
#include "core/film/tile.h"
#include "worker/render/render.h"

namespace relume::bench {

// What a piece of work took.
struct Cost {
    double wall = 0;  // seconds
    double cpu = 0;   // seconds of all threads
    std::uint64_t rays = 0;
};

// Renders the samples [0, spp) of all pixels of `window`, a tile at a time, as many threads as
// asked for. `logs`, if given, becomes one log of the rays a tile.
Cost Render(const render::Renderer& renderer, const TileRect& window, std::uint32_t spp,
            int threads, std::vector<RayLog>* logs = nullptr);

// Traces what was recorded again, without the renderer.
Cost ReplayAll(const std::vector<RayLog>& logs, int threads);

// The most memory that this process ever had in use, in bytes (VmHWM).
std::size_t PeakMemory();

}  // namespace relume::bench
