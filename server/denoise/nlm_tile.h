#pragma once

#include <cstddef>
#include <functional>
#include <vector>

#include "core/base/cancel_token.h"
#include "core/film/tile.h"
#include "server/denoise/frame.h"

namespace relume::denoise {

// What filters of one offset at a time over a tile share.

TileRect Grow(const TileRect& rect, int by);
TileRect Intersect(const TileRect& a, const TileRect& b);

// The pixels of an image whose neighbour at (dx, dy) lies in it too.
TileRect PixelsWithNeighbour(int width, int height, int dx, int dy);

// Sets `plane`, which holds `area`, to `value` outside of `keep`.
void FillOutside(float* plane, std::ptrdiff_t stride, const TileRect& area, const TileRect& keep,
                 float value);

// A plane's part around a tile of at most max_width x max_height pixels, 0 outside of the image, so
// that neighbours up to `halo` pixels away are read without asking.
class HaloPlane {
  public:
    HaloPlane(int max_width, int max_height, int halo);

    // `plane` x scale; width and height are the image's.
    void Load(const Plane& plane, int width, int height, const TileRect& tile, float scale = 1);
    // At the tile's first pixel.
    const float* origin() const { return data_.data() + halo_ * (stride_ + 1); }
    std::ptrdiff_t stride() const { return stride_; }
    std::size_t size() const { return data_.size(); }

  private:
    int halo_;
    std::ptrdiff_t stride_;
    std::vector<float> data_;
};

// One of each pair (dx, dy), (-dx, -dy) of the (2 radius + 1)^2 window but (0, 0), in reading
// order.
std::vector<std::pair<int, int>> HalfWindow(int radius);

// Tiles of at most tile_width x tile_height pixels that cover the image, on several threads:
// make() once a thread gives what calls body(tile). Throws kCancelled soon after `cancel` is set.
using TileBody = std::function<void(const TileRect& tile)>;
void ForTilesOf(int width, int height, int tile_width, int tile_height, const CancelToken& cancel,
                const std::function<TileBody()>& make);

}  // namespace relume::denoise
