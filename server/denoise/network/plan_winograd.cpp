// 3x3 convolutions in Winograd's tiles: read where they lie, upsampled or not, multiplied, and
// written to where they belong, pooled or not.
#include <algorithm>

#include "core/base/parallel.h"
#include "server/denoise/cancelled.h"
#include "server/denoise/network/plan.h"

namespace relume::denoise {
namespace {

constexpr int kMostLanes = 16;

int RoundUp(int value, int to) { return (value + to - 1) / to * to; }

// From one pixel's channels to the next one's. A vector more than the inputs fill, as a source's
// last vector of channels may reach beyond them.
std::ptrdiff_t Pitch(const WinogradWeights& weights, int lanes) {
    return RoundUp(weights.inputs() + lanes - 1, lanes);
}

// From one matrix to the next: a vector more than it has, so that 36 of them don't all fall into
// the same few lines of the cache.
std::ptrdiff_t Step(std::ptrdiff_t pitch, int tiles, int lanes) { return tiles * pitch + lanes; }

struct Tile {
    int x, y;  // of its first pixel, which may lie outside
    bool inside;
    const float* rows[6];
    std::ptrdiff_t columns[6];
};

// A tile's pixels come late: what is read so many tiles ahead is there when it is needed.
constexpr int kAhead = 3;

void Prefetch(const Tile& tile) {
    for (const float* row : tile.rows) {
        for (int x = 2; x < 6; ++x) {  // the first two are the last ones of the tile before
            __builtin_prefetch(row + tile.columns[x]);
        }
    }
}

}  // namespace

std::size_t Plan::MatrixFloats(const Step& step) const {
    if (step.winograd == nullptr) {
        return 0;
    }
    const int lanes = kernels_->lanes;
    return static_cast<std::size_t>(36 *
                                    (denoise::Step(Pitch(*step.winograd, lanes), kTiles, lanes) +
                                     denoise::Step(step.winograd->outputs(), kTiles, lanes)));
}

std::ptrdiff_t Plan::RowFloats(int tensor) const {
    const int width = width_ >> graph_.tensors[static_cast<std::size_t>(tensor)].scale;
    return static_cast<std::ptrdiff_t>(width) * static_cast<std::ptrdiff_t>(lanes_);
}

// In each turn a step does a band, the next one the band before, less a row, as it reads a row
// beyond its own.
void Plan::RunChain(const PlanChain& chain, const Target& target, const CancelToken& cancel) {
    const Step& step = steps_[static_cast<std::size_t>(chain.first)];
    const int columns = (step.width + 3) / 4, rows = (step.height + 3) / 4;
    struct Band {
        std::size_t step;
        int first, count;  // tiles
    };
    for (int turn = 0, done = 0; done < rows; ++turn) {
        std::vector<Band> groups;
        for (int i = 0; i <= chain.last - chain.first; ++i) {
            const int begin = std::clamp((turn - i) * chain.band - i, 0, rows);
            const int end = std::clamp((turn - i + 1) * chain.band - i, 0, rows);
            for (int first = begin * columns; first < end * columns; first += kTiles) {
                groups.push_back({static_cast<std::size_t>(chain.first + i), first,
                                  std::min(kTiles, end * columns - first)});
            }
            done = end;  // of the last step in the end
        }
        ParallelFor(0, groups.size(), 1, [&](std::size_t begin, std::size_t end) {
            for (std::size_t g = begin; g < end; ++g) {
                ThrowIfCancelled(cancel);
                RunTiles(groups[g].step, groups[g].first, groups[g].count, target);
            }
        });
    }
}

void Plan::RunTiles(std::size_t s, int first, int count, const Target& target) {
    const WinogradWeights& weights = *steps_[s].winograd;
    const Borrowed scratch(this);
    const int lanes = kernels_->lanes;
    const std::ptrdiff_t pitch = Pitch(weights, lanes);
    const std::ptrdiff_t step = denoise::Step(pitch, kTiles, lanes);
    float* tiles = scratch->matrices.get();
    float* sums = tiles + 36 * step;
    ReadTiles(s, first, count, tiles);
    weights.Multiply(tiles, step, pitch, count, sums,
                     denoise::Step(weights.outputs(), kTiles, lanes));
    StoreTiles(s, first, count, sums, target);
}

void Plan::ReadTiles(std::size_t s, int first, int count, float* to) const {
    const WinogradWeights& weights = *steps_[s].winograd;
    const int width = steps_[s].width, height = steps_[s].height;
    const int tile_columns = (width + 3) / 4;
    const int lanes = kernels_->lanes;
    const std::ptrdiff_t pitch = Pitch(weights, lanes);
    const std::ptrdiff_t step = denoise::Step(pitch, kTiles, lanes);
    Tile tiles[kTiles];
    for (const GraphSource& source : graph_.steps[s].sources) {
        for (int t = 0; t < count; ++t) {
            Tile& tile = tiles[t];
            tile.x = (first + t) % tile_columns * 4 - 1;
            tile.y = (first + t) / tile_columns * 4 - 1;
            tile.inside = tile.x >= 0 && tile.y >= 0 && tile.x + 6 <= width && tile.y + 6 <= height;
            for (int i = 0; i < 6; ++i) {
                const int y = std::clamp(tile.y + i, 0, height - 1);
                const int x = std::clamp(tile.x + i, 0, width - 1);
                tile.rows[i] = Pixel(source.tensor, y >> source.up, 0, 0);
                tile.columns[i] = static_cast<std::ptrdiff_t>(x >> source.up) * lanes;
            }
        }
        // Tile by tile in the inner loop: neighbours lie one after another in memory.
        const std::ptrdiff_t next_group = RowFloats(source.tensor);
        const int groups = Groups(source.tensor);
        for (int group = 0; group < groups; ++group) {
            for (int t = 0; t < count; ++t) {
                Tile& tile = tiles[t];
                float* at = to + t * pitch + group * lanes;
                Prefetch(tiles[(t + kAhead) % count]);  // at the end the next group's
                if (tile.inside) {
                    kernels_->transform_input(tile.rows, tile.columns, at, step);
                } else {
                    TransformBorder(tile.rows, tile.columns, tile.x, tile.y, width, height, at,
                                    step);
                }
                for (const float*& row : tile.rows) {
                    row += next_group;
                }
            }
        }
        // The next source's first channels take the place of what filled up this one's last vector.
        to += graph_.tensors[static_cast<std::size_t>(source.tensor)].channels;
    }
}

// Of a tile of which some pixels, which lie outside, are zero.
void Plan::TransformBorder(const float* const* rows, const std::ptrdiff_t* columns, int x0, int y0,
                           int width, int height, float* to, std::ptrdiff_t step) const {
    const int lanes = kernels_->lanes;
    alignas(64) float tile[36 * kMostLanes] = {};
    const float* tile_rows[6];
    std::ptrdiff_t tile_columns[6];
    for (int i = 0; i < 6; ++i) {
        tile_rows[i] = tile + 6 * i * lanes;
        tile_columns[i] = static_cast<std::ptrdiff_t>(i) * lanes;
        for (int j = 0; j < 6; ++j) {
            const int x = x0 + j, y = y0 + i;
            if (x >= 0 && y >= 0 && x < width && y < height) {
                std::copy_n(rows[i] + columns[j], lanes, tile + (6 * i + j) * lanes);
            }
        }
    }
    kernels_->transform_input(tile_rows, tile_columns, to, step);
}

void Plan::StoreTiles(std::size_t s, int first, int count, const float* sums,
                      const Target& target) const {
    const GraphStep& graph_step = graph_.steps[s];
    const WinogradWeights& weights = *steps_[s].winograd;
    const int width = steps_[s].width, height = steps_[s].height;
    const int tile_columns = (width + 3) / 4;
    const int lanes = kernels_->lanes, outputs = weights.outputs();
    const std::ptrdiff_t step = denoise::Step(outputs, kTiles, lanes);
    const int side = graph_step.pool ? 2 : 4;
    const int scale = graph_step.pool ? 1 : 0;
    alignas(64) float result[16 * kMostLanes];
    const std::ptrdiff_t next_group = graph_step.tensor >= 0 ? RowFloats(graph_step.tensor) : 0;
    const std::ptrdiff_t next_row = next_group * (outputs / lanes);
    for (int t = 0; t < count; ++t) {
        const int x0 = (first + t) % tile_columns * 4, y0 = (first + t) / tile_columns * 4;
        const int columns = std::min(4, width - x0) >> scale;
        const int rows = std::min(4, height - y0) >> scale;
        // A tile's rows lie one after another: rings of rows have whole tiles.
        float* to = graph_step.tensor >= 0 ? Pixel(graph_step.tensor, y0 >> scale, 0, x0 >> scale)
                                           : nullptr;
        for (int group = 0; group < outputs / lanes; ++group) {
            const float* from = sums + static_cast<std::ptrdiff_t>(t) * outputs + group * lanes;
            const float* bias = weights.bias() + group * lanes;
            if (to != nullptr && columns == side && rows == side) {
                kernels_->transform_output(from, step, bias, graph_step.relu, graph_step.pool,
                                           to + group * next_group, next_row);
                continue;
            }
            kernels_->transform_output(from, step, bias, graph_step.relu, graph_step.pool, result,
                                       static_cast<std::ptrdiff_t>(side) * lanes);
            for (int y = 0; y < rows; ++y) {
                const float* line = result + side * y * lanes;
                if (to != nullptr) {
                    std::copy_n(line, columns * lanes, to + group * next_group + y * next_row);
                } else {
                    StoreOutputLine({x0, y0 + y, columns, 1}, group, line, target);
                }
            }
        }
    }
}

// Channels of a group, of one row of at most 4 pixels.
void Plan::StoreOutputLine(const Block& line, int group, const float* result,
                           const Target& target) const {
    const PlanTile& tile = *target.tile;
    const int y = tile.y + line.y, inner_y = y - tile.inner_y;
    if (inner_y < 0 || inner_y >= tile.inner_height) {
        return;
    }
    const auto channels = target.outputs->size();
    const std::size_t first = static_cast<std::size_t>(group) * lanes_;
    for (std::size_t c = first; c < std::min(channels, first + lanes_); ++c) {
        float* to = (*target.outputs)[c].data() +
                    static_cast<std::ptrdiff_t>(y) * target.image_width + tile.x;
        for (int x = 0; x < line.columns; ++x) {
            const int inner_x = tile.x + line.x + x - tile.inner_x;
            if (inner_x >= 0 && inner_x < tile.inner_width) {
                to[line.x + x] = result[static_cast<std::size_t>(x) * lanes_ + (c - first)];
            }
        }
    }
}

}  // namespace relume::denoise
