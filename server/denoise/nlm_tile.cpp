#include "server/denoise/nlm_tile.h"

#include <algorithm>

#include "core/base/parallel.h"
#include "server/denoise/cancelled.h"
#include "server/denoise/nlm_kernels.h"

namespace relume::denoise {

TileRect Grow(const TileRect& r, int by) { return {r.x0 - by, r.y0 - by, r.x1 + by, r.y1 + by}; }

TileRect Intersect(const TileRect& a, const TileRect& b) {
    return {std::max(a.x0, b.x0), std::max(a.y0, b.y0), std::min(a.x1, b.x1), std::min(a.y1, b.y1)};
}

TileRect PixelsWithNeighbour(int width, int height, int dx, int dy) {
    return {std::max(0, -dx), std::max(0, -dy), std::min(width, width - dx),
            std::min(height, height - dy)};
}

void FillOutside(float* plane, std::ptrdiff_t stride, const TileRect& area, const TileRect& keep,
                 float value) {
    const TileRect inside = Intersect(area, keep);
    if (inside == area) {
        return;
    }
    for (int y = area.y0; y < area.y1; ++y, plane += stride) {
        if (y < inside.y0 || y >= inside.y1 || inside.empty()) {
            std::fill_n(plane, area.width(), value);
        } else {
            std::fill(plane, plane + (inside.x0 - area.x0), value);
            std::fill(plane + (inside.x1 - area.x0), plane + area.width(), value);
        }
    }
}

HaloPlane::HaloPlane(int max_width, int max_height, int halo)
    : halo_(halo),
      stride_((max_width + 2 * halo + kNlmLanes - 1) / kNlmLanes * kNlmLanes),
      data_(static_cast<std::size_t>(stride_ * (max_height + 2 * halo) + kNlmLanes)) {}

void HaloPlane::Load(const Plane& plane, int width, int height, const TileRect& tile, float scale) {
    const TileRect area = Grow(tile, halo_);
    const TileRect inside = Intersect(area, {0, 0, width, height});
    if (!(inside == area)) {
        std::ranges::fill(data_, 0.0f);
    }
    for (int y = inside.y0; y < inside.y1; ++y) {
        const float* from = plane.data() + static_cast<std::ptrdiff_t>(y) * width;
        float* row = data_.data() + (y - area.y0) * stride_ - area.x0;
        for (int x = inside.x0; x < inside.x1; ++x) {
            row[x] = from[x] * scale;
        }
    }
}

std::vector<std::pair<int, int>> HalfWindow(int radius) {
    std::vector<std::pair<int, int>> offsets;
    for (int dy = 0; dy <= radius; ++dy) {
        for (int dx = dy == 0 ? 1 : -radius; dx <= radius; ++dx) {
            offsets.emplace_back(dx, dy);
        }
    }
    return offsets;
}

void ForTilesOf(int width, int height, int tile_width, int tile_height, const CancelToken& cancel,
                const std::function<TileBody()>& make) {
    const auto across = static_cast<std::size_t>((width + tile_width - 1) / tile_width);
    const auto down = static_cast<std::size_t>((height + tile_height - 1) / tile_height);
    ParallelFor(0, across * down, 1, [&](std::size_t begin, std::size_t end) {
        const TileBody body = make();
        for (std::size_t t = begin; t < end; ++t) {
            ThrowIfCancelled(cancel);
            const int x0 = static_cast<int>(t % across) * tile_width;
            const int y0 = static_cast<int>(t / across) * tile_height;
            body({x0, y0, std::min(x0 + tile_width, width), std::min(y0 + tile_height, height)});
        }
    });
}

}  // namespace relume::denoise
