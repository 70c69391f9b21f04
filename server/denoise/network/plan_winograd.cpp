// 3x3 convolutions in Winograd's tiles: read where they lie, upsampled or not, multiplied, and
// written to where they belong, pooled or not.
#include <algorithm>

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
    alignas(64) float border[36 * kMostLanes];
    for (const GraphSource& source : graph_.steps[s].sources) {
        for (int group = 0; group < Groups(source.tensor); ++group) {
            for (int t = 0; t < count; ++t) {
                const int x0 = (first + t) % tile_columns * 4 - 1;
                const int y0 = (first + t) / tile_columns * 4 - 1;
                const float* rows[6];
                std::ptrdiff_t columns[6];
                if (x0 >= 0 && y0 >= 0 && x0 + 6 <= width && y0 + 6 <= height) {
                    for (int i = 0; i < 6; ++i) {
                        rows[i] = Pixel(source.tensor, (y0 + i) >> source.up, group, 0);
                        columns[i] = static_cast<std::ptrdiff_t>((x0 + i) >> source.up) * lanes;
                    }
                } else {
                    std::fill_n(border, 36 * lanes, 0.0f);
                    for (int i = 0; i < 6; ++i) {
                        rows[i] = border + 6 * i * lanes;
                        columns[i] = i * lanes;
                        for (int j = 0; j < 6; ++j) {
                            const int x = x0 + j, y = y0 + i;
                            if (x >= 0 && y >= 0 && x < width && y < height) {
                                std::copy_n(
                                    Pixel(source.tensor, y >> source.up, group, x >> source.up),
                                    lanes, border + (6 * i + j) * lanes);
                            }
                        }
                    }
                }
                kernels_->transform_input(rows, columns, to + t * pitch + group * lanes, step);
            }
        }
        // The next source's first channels take the place of what filled up this one's last vector.
        to += graph_.tensors[static_cast<std::size_t>(source.tensor)].channels;
    }
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
    for (int group = 0; group < outputs / lanes; ++group) {
        const float* bias = weights.bias() + group * lanes;
        for (int t = 0; t < count; ++t) {
            const int x0 = (first + t) % tile_columns * 4, y0 = (first + t) / tile_columns * 4;
            const float* from = sums + static_cast<std::ptrdiff_t>(t) * outputs + group * lanes;
            const bool whole = x0 + 4 <= width && y0 + 4 <= height;
            const auto transform = [&](float* to, std::ptrdiff_t row) {
                kernels_->transform_output(from, step, bias, graph_step.relu, graph_step.pool, to,
                                           row);
            };
            if (graph_step.tensor >= 0 && whole) {
                transform(Pixel(graph_step.tensor, y0 >> scale, group, x0 >> scale),
                          static_cast<std::ptrdiff_t>(width >> scale) * (outputs / lanes) * lanes);
                continue;
            }
            transform(result, static_cast<std::ptrdiff_t>(side) * lanes);
            const int columns = std::min(4, width - x0) >> scale;
            const int rows = std::min(4, height - y0) >> scale;
            for (int y = 0; y < rows; ++y) {
                const float* line = result + side * y * lanes;
                if (graph_step.tensor >= 0) {
                    std::copy_n(line, columns * lanes,
                                Pixel(graph_step.tensor, (y0 >> scale) + y, group, x0 >> scale));
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
