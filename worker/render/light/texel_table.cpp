#include "worker/render/light/texel_table.h"

#include <algorithm>

namespace relume::render {
namespace {

constexpr std::size_t kMostBlocks = 32768;  // 6 bytes each
constexpr float kBelowOne = 0x1.fffffep-1f;

// Cumulative probabilities of `weights`, and for each k the first index whose upper bound is above
// k/n.
void Accumulate(const double* weights, int n, float* cumulative, std::uint16_t* guess) {
    double sum = 0;
    for (int i = 0; i < n; ++i) {
        sum += weights[i];
    }
    double running = 0;
    cumulative[0] = 0;
    for (int i = 0; i < n; ++i) {
        running += sum > 0 ? weights[i] : 1;
        cumulative[i + 1] = static_cast<float>(running / (sum > 0 ? sum : n));
    }
    // The last index with any probability ends at 1 exactly.
    for (int i = n; i > 0 && cumulative[i] == cumulative[n]; --i) {
        if (i < n) {
            cumulative[i] = 1;
        }
    }
    cumulative[n] = 1;
    int at = 0;
    for (int k = 0; k < n; ++k) {
        const float u = static_cast<float>(k) / static_cast<float>(n);
        while (at + 1 < n && cumulative[at + 1] <= u) {
            ++at;
        }
        guess[k] = static_cast<std::uint16_t>(at);
    }
}

// Weights of a level, and how many there are.
struct Level {
    int width = 0, height = 0;
    std::vector<double> weights;
};

// One of four parts, by their running sums; what is left of u.
int Pick(float a, float b, float c, float d, float* u) {
    const float x = *u * d;
    int i = (x >= a ? 1 : 0) + (x >= b ? 1 : 0) + (x >= c ? 1 : 0);
    const float upper[5] = {0, a, b, c, d};
    while (i > 0 && upper[i + 1] <= upper[i]) {  // rounding may lead past the last with any weight
        --i;
    }
    const float width = upper[i + 1] - upper[i];
    *u = width > 0 ? std::clamp((x - upper[i]) / width, 0.0f, kBelowOne) : 0.5f;
    return i;
}

}  // namespace

TexelTable::TexelTable(const SphereMap& map) {
    Level level{map.width(), map.height(), {}};
    for (int y = 0; y < level.height; ++y) {
        for (int x = 0; x < level.width; ++x) {
            level.weights.push_back(map.At(x, y).a);
        }
    }
    while (level.weights.size() > kMostBlocks) {
        Level above{(level.width + 3) / 4, (level.height + 3) / 4, {}};
        std::vector<Block> blocks(static_cast<std::size_t>(above.width) *
                                  static_cast<std::size_t>(above.height));
        above.weights.resize(blocks.size());
        for (std::size_t i = 0; i < blocks.size(); ++i) {
            const int x0 = 4 * static_cast<int>(i % static_cast<std::size_t>(above.width));
            const int y0 = 4 * static_cast<int>(i / static_cast<std::size_t>(above.width));
            for (int y = 0; y < 4; ++y) {
                double row = 0;
                for (int x = 0; x < 4; ++x) {
                    if (x0 + x < level.width && y0 + y < level.height) {
                        row += level.weights[static_cast<std::size_t>(y0 + y) *
                                                 static_cast<std::size_t>(level.width) +
                                             static_cast<std::size_t>(x0 + x)];
                    }
                    blocks[i].sums[static_cast<std::size_t>(4 * y + x)] = static_cast<float>(row);
                }
                above.weights[i] += row;
            }
        }
        steps_.insert(steps_.begin(), Step{above.width, std::move(blocks)});
        level = std::move(above);
    }
    width_ = level.width;
    height_ = level.height;
    const auto w = static_cast<std::size_t>(width_), h = static_cast<std::size_t>(height_);
    cumulative_.resize(h * (w + 1) + h + 1);
    guess_.resize(h * w + h);
    std::vector<double> rows(h);
    for (std::size_t y = 0; y < h; ++y) {
        const double* row = &level.weights[y * w];
        Accumulate(row, width_, &cumulative_[y * (w + 1)], &guess_[y * w]);
        for (std::size_t x = 0; x < w; ++x) {
            rows[y] += row[x];
        }
    }
    Accumulate(rows.data(), height_, &cumulative_[h * (w + 1)], &guess_[h * w]);
}

TexelTable::Row TexelTable::RowOf(int y) const {
    const std::size_t w = static_cast<std::size_t>(width_), row = static_cast<std::size_t>(y);
    return {&cumulative_[row * (w + 1)], &guess_[row * w], y == height_ ? height_ : width_};
}

int TexelTable::Row::Sample(float* u) const {
    int i = guess[std::min(static_cast<int>(*u * static_cast<float>(n)), n - 1)];
    // Rounding of u n may guess one too far.
    while (i > 0 && cumulative[i] > *u) {
        --i;
    }
    while (i + 1 < n && cumulative[i + 1] <= *u) {
        ++i;
    }
    const float width = cumulative[i + 1] - cumulative[i];
    *u = width > 0 ? std::min((*u - cumulative[i]) / width, kBelowOne) : 0.5f;
    return i;
}

TexelTable::Texel TexelTable::Sample(Vec2f* u) const {
    Texel at;
    at.y = RowOf(height_).Sample(&u->y);
    at.x = RowOf(at.y).Sample(&u->x);
    for (const Step& step : steps_) {
        const std::array<float, 16>& s =
            step.blocks[static_cast<std::size_t>(at.y) * static_cast<std::size_t>(step.width) +
                        static_cast<std::size_t>(at.x)]
                .sums;
        const float a = s[3], b = a + s[7], c = b + s[11];
        const int y = Pick(a, b, c, c + s[15], &u->y);
        const float* row = &s[static_cast<std::size_t>(4 * y)];
        const int x = Pick(row[0], row[1], row[2], row[3], &u->x);
        at = {4 * at.x + x, 4 * at.y + y};
    }
    return at;
}

}  // namespace relume::render
