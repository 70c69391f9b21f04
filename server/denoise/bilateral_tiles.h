#pragma once

#include <functional>
#include <memory>
#include <string>
#include <vector>

#include "core/base/cancel_token.h"
#include "server/denoise/bilateral_kernels.h"
#include "server/denoise/frame.h"

namespace relume::denoise {

// What the bilateral filter compares pixels by. Every plane is filled; a feature that the frame
// lacks is 0 everywhere and so has no say.
struct Guides {
    Plane feature[7];   // normal XYZ, albedo RGB, depth over the frame's largest
    Plane variance[3];  // of one sample, summed over the group: normal, albedo, depth
    std::string names;  // "normal, albedo, depth": those that the frame has
};
Guides MakeGuides(const Frame& frame);

// Floats from a cache line's border on: zeros, or whatever is there.
class AlignedFloats {
  public:
    explicit AlignedFloats(std::size_t size) : lines_(std::make_unique<Line[]>(Lines(size))) {}
    static AlignedFloats Raw(std::size_t size) {
        return AlignedFloats(std::make_unique_for_overwrite<Line[]>(Lines(size)));
    }
    float* data() { return lines_[0].values; }

  private:
    struct alignas(64) Line {
        float values[16];
    };
    explicit AlignedFloats(std::unique_ptr<Line[]> lines) : lines_(std::move(lines)) {}
    static std::size_t Lines(std::size_t size) { return size / 16 + 1; }

    std::unique_ptr<Line[]> lines_;
};

struct TileShape {
    int width = kTileWidth, height = kTileHeight, halo = 0;  // pixels
};
inline constexpr TileShape kPairTile = {kPairWidth, kPairHeight, kBankRadius};

// One tile's scratch: `count` planes with their halo, for one thread.
class TilePlanes {
  public:
    TilePlanes(int count, const TileShape& shape);

    // Copies the part of `plane` (width x height) around the tile at (x0, y0); `outside` where
    // there is none.
    void Load(int index, const Plane& plane, int width, int height, int x0, int y0, float outside);
    // Each plane at the tile's first pixel.
    const float* const* planes() const { return planes_.data(); }
    std::ptrdiff_t stride() const { return stride_; }

  private:
    TileShape shape_;
    std::ptrdiff_t stride_, plane_size_;  // floats
    AlignedFloats data_;
    std::vector<const float*> planes_;
};

struct TileArea {
    int x0, y0, width, height;  // pixels, at most the shape's
};

// Rows [begin, end) of a frame.
struct RowRange {
    int begin, end;
};

// Calls body(tile, scratch) for every tile of the frame, or of some of its rows, on several
// threads, each with a scratch of its own. Throws kCancelled soon after `cancel` is set.
void ForEachTile(const Frame& frame, RowRange rows, int planes, const TileShape& shape,
                 const CancelToken& cancel,
                 const std::function<void(const TileArea&, TilePlanes&)>& body);
// In tiles of kTileWidth x kTileHeight with a halo of `radius`.
void ForEachTile(const Frame& frame, int planes, int radius, const CancelToken& cancel,
                 const std::function<void(const TileArea&, TilePlanes&)>& body);

}  // namespace relume::denoise
