#include "server/denoise/frame_parts.h"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <utility>

#include "server/denoise/crop_frame.h"

namespace relume::denoise {
namespace {

constexpr int kInner = 64, kHalo = 24;
constexpr std::size_t kWindow = (kInner + 2 * kHalo) * (kInner + 2 * kHalo);  // pixels

std::uint32_t Hash(std::uint32_t v) {
    v = v * 747796405u + 2891336453u;
    v = ((v >> ((v >> 28) + 4)) ^ v) * 277803737u;
    return (v >> 22) ^ v;
}

}  // namespace

std::vector<TileRect> ChooseWindows(const Frame& frame, int share, double fewest) {
    const int width = frame.width, height = frame.height;
    const std::size_t pixels = static_cast<std::size_t>(width) * static_cast<std::size_t>(height);
    const double cells =
        std::max(fewest, static_cast<double>(pixels) / (share * static_cast<double>(kWindow)));
    if (1.5 * cells * kWindow >= static_cast<double>(pixels) || width < kInner || height < kInner) {
        return {{0, 0, width, height}};
    }
    const double aspect = static_cast<double>(width) / height;
    const int across =
        std::clamp(static_cast<int>(std::lround(std::sqrt(cells * aspect))), 1, width / kInner);
    const int down = std::clamp(static_cast<int>(std::lround(cells / across)), 1, height / kInner);
    std::vector<TileRect> windows;
    const auto place = [](int cell, int cells_of, int size, std::uint32_t random) {
        const int begin = static_cast<int>(std::int64_t{size} * cell / cells_of);
        const int end = static_cast<int>(std::int64_t{size} * (cell + 1) / cells_of);
        return begin +
               static_cast<int>(random % static_cast<std::uint32_t>(end - begin - kInner + 1));
    };
    for (int v = 0; v < down; ++v) {
        for (int u = 0; u < across; ++u) {
            const std::uint32_t random = Hash(static_cast<std::uint32_t>(v * across + u));
            const int x = place(u, across, width, random), y = place(v, down, height, Hash(random));
            windows.push_back({x, y, x + kInner, y + kInner});
        }
    }
    return windows;
}

FramePart CutPart(const Frame& frame, const TileRect& window) {
    const TileRect outer = {std::max(window.x0 - kHalo, 0), std::max(window.y0 - kHalo, 0),
                            std::min(window.x1 + kHalo, frame.width),
                            std::min(window.y1 + kHalo, frame.height)};
    return {
        CropFrame(frame, outer),
        {window.x0 - outer.x0, window.y0 - outer.y0, window.x1 - outer.x0, window.y1 - outer.y0},
        outer};
}

}  // namespace relume::denoise
