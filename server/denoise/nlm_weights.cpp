#include "server/denoise/nlm_weights.h"

#include <algorithm>
#include <cmath>

namespace relume::denoise {
namespace {

std::ptrdiff_t RoundUp(int n) { return (n + kNlmLanes - 1) / kNlmLanes * kNlmLanes; }

}  // namespace

NlmGuide::NlmGuide(int width_, int height_, const Plane (&value_)[3], const Plane (&variance_)[3],
                   float scale)
    : width(width_),
      height(height_),
      value{&value_[0], &value_[1], &value_[2]},
      variance{&variance_[0], &variance_[1], &variance_[2]},
      variance_scale(scale) {}

NlmWeights::NlmWeights(const NlmOptions& options, int radius, int max_width, int max_height,
                       const NlmKernels& kernels)
    : options_(options),
      radius_(radius),
      halo_(options.weight_patch + options.patch + radius),
      kernels_(kernels),
      value_(kNlmChannels, HaloPlane(max_width, max_height, halo_)),
      variance_(value_) {
    const int outer = 2 * (options.weight_patch + options.patch);
    raw_stride_ = RoundUp(max_width + outer + radius);
    for (auto& plane : raw_) {
        plane.resize(
            static_cast<std::size_t>(raw_stride_ * (max_height + outer + radius) + kNlmLanes));
    }
    out_stride_ = RoundUp(max_width + 2 * options.weight_patch) + kNlmLanes;
    for (auto* plane : {&forward_, &backward_, &between_, &smooth_}) {
        plane->resize(static_cast<std::size_t>(
            out_stride_ * (max_height + 2 * options.weight_patch) + kNlmLanes));
    }
    const auto row_size = static_cast<std::size_t>(max_width + outer + 3 * kNlmLanes);
    rows_.resize(kNlmBoxRows * row_size);
    for (Counts& counts : counts_) {
        counts.across.resize(row_size);
        counts.down.resize(static_cast<std::size_t>(max_height + outer));
    }
}

void NlmWeights::Load(const NlmGuide& guide, const TileRect& tile) {
    image_width_ = guide.width;
    image_height_ = guide.height;
    tile_ = tile;
    inside_loaded_ = false;
    channels_ = static_cast<int>(guide.value.size());
    for (std::size_t c = 0; c < guide.value.size(); ++c) {
        value_[c].Load(*guide.value[c], guide.width, guide.height, tile);
        variance_[c].Load(*guide.variance[c], guide.width, guide.height, tile,
                          guide.variance_scale);
    }
}

TileRect NlmWeights::Inside(int dx, int dy) const {
    return PixelsWithNeighbour(image_width_, image_height_, dx, dy);
}

// One over the number of columns and rows within `patch` of each that lie in `keep`.
void NlmWeights::FillInverseCounts(const TileRect& area, const TileRect& keep, int patch,
                                   Counts* counts) const {
    const auto fill = [patch](int from, int to, int first, int last, float* out) {
        for (int x = from; x < to; ++x) {
            const int count = std::min(x + patch + 1, last) - std::max(x - patch, first);
            *out++ = count > 0 ? 1.0f / static_cast<float>(count) : 0.0f;
        }
    };
    fill(area.x0, area.x1, keep.x0, keep.x1, counts->across.data());
    fill(area.y0, area.y1, keep.y0, keep.y1, counts->down.data());
}

NlmPair NlmWeights::PairAt(const TileRect& area, int dx, int dy) const {
    NlmPair pair{};
    const std::ptrdiff_t stride = value_[0].stride();
    const std::ptrdiff_t at = (area.y0 - tile_.y0) * stride + area.x0 - tile_.x0;
    for (int c = 0; c < channels_; ++c) {
        pair.value[c] = value_[static_cast<std::size_t>(c)].origin() + at;
        pair.variance[c] = variance_[static_cast<std::size_t>(c)].origin() + at;
    }
    pair.channels = channels_;
    pair.stride = stride;
    pair.shift = dy * stride + dx;
    pair.alpha = options_.alpha;
    pair.k_squared = options_.k * options_.k;
    pair.epsilon = options_.epsilon;
    pair.largest = options_.largest;
    pair.own_variance = options_.own_variance;
    return pair;
}

// Mean over the patch of the plane `raw`, which holds the distances of `raw_area`, for the tile and
// its margin; `keep` is where they are distances between pixels of the image.
void NlmWeights::BoxInto(const float* raw, const TileRect& raw_area, const TileRect& keep,
                         NlmDirection direction) {
    const TileRect area = Grow(tile_, options_.weight_patch);
    std::vector<float>& out = direction == kForward    ? forward_
                              : direction == kBackward ? backward_
                                                       : between_;
    Counts& counts = counts_[direction];
    FillInverseCounts(area, keep, options_.patch, &counts);
    kernels_.box(raw + (area.y0 - raw_area.y0) * raw_stride_ + area.x0 - raw_area.x0, raw_stride_,
                 options_.patch, area.width(), area.height(), counts.across.data(),
                 counts.down.data(), rows_.data(), out.data(), out_stride_);
    FillOutside(out.data(), out_stride_, area, keep, kNlmOutside);
}

void NlmWeights::ComputeDistances(int dx, int dy) {
    const TileRect patched = Grow(tile_, options_.weight_patch + options_.patch);
    // Pairs (q, q + d): forward has q in the tile, backward q + d.
    const TileRect pairs = {patched.x0 - std::max(dx, 0), patched.y0 - std::max(dy, 0),
                            patched.x1 - std::min(dx, 0), patched.y1 - std::min(dy, 0)};
    const TileRect moved = {pairs.x0 + dx, pairs.y0 + dy, pairs.x1 + dx, pairs.y1 + dy};
    const TileRect ahead = Inside(dx, dy), behind = Inside(-dx, -dy);
    const TileRect both = Intersect(ahead, behind);
    kernels_.pair(PairAt(pairs, dx, dy), pairs.width(), pairs.height(), raw_[0].data(),
                  raw_[1].data(), raw_stride_);
    FillOutside(raw_[0].data(), raw_stride_, pairs, ahead, 0);
    FillOutside(raw_[1].data(), raw_stride_, pairs, ahead, 0);
    BoxInto(raw_[0].data(), pairs, ahead, kForward);
    BoxInto(raw_[1].data(), moved, behind, kBackward);
    if (options_.symmetric) {
        kernels_.between(PairAt(patched, dx, dy), patched.width(), patched.height(), raw_[0].data(),
                         raw_stride_);
        FillOutside(raw_[0].data(), raw_stride_, patched, both, 0);
        BoxInto(raw_[0].data(), patched, both, kBetween);
    }
}

void NlmWeights::ComputeNudgedDistances(int dx, int dy, float factor) {
    if (!inside_loaded_) {
        const std::ptrdiff_t stride = value_[0].stride();
        inside_.assign(value_[0].size(), 1.0f);
        FillOutside(inside_.data(), stride, Grow(tile_, halo_), {0, 0, image_width_, image_height_},
                    0);
        inside_loaded_ = true;
    }
    for (auto& plane : nudged_) {
        plane.resize(forward_.size());
    }
    NlmNudge nudge{};
    nudge.factor = factor;
    nudge.near = std::max(std::abs(dx), std::abs(dy)) <= options_.patch;
    nudge.inside = inside_.data() + halo_ * (value_[0].stride() + 1);
    const float* distance[] = {forward(), backward(), options_.symmetric ? between() : nullptr};
    for (int d = 0; d < kNlmDirections; ++d) {
        nudge.across[d] = counts_[d].across.data();
        nudge.down[d] = counts_[d].down.data();
        nudge.distance[d] = distance[d];
        nudge.nudged[d] = nudged_[d].data();
    }
    nudge.stride = out_stride_;
    kernels_.nudge(PairAt(tile_, dx, dy), nudge, tile_.width(), tile_.height());
}

// Replaces the weights by their mean over the patch, of those that have a neighbour in the image.
void NlmWeights::SmoothWeights(const TileRect& keep, std::vector<float>* plane) {
    Counts& counts = counts_[kForward];
    FillInverseCounts(tile_, keep, options_.weight_patch, &counts);
    const std::ptrdiff_t at = options_.weight_patch * (out_stride_ + 1);
    kernels_.box(plane->data() + at, out_stride_, options_.weight_patch, tile_.width(),
                 tile_.height(), counts.across.data(), counts.down.data(), rows_.data(),
                 smooth_.data() + at, out_stride_);
    FillOutside(smooth_.data() + at, out_stride_, tile_, keep, 0);
    plane->swap(smooth_);
}

void NlmWeights::ComputeWeights(int dx, int dy) {
    ComputeDistances(dx, dy);
    const TileRect area = Grow(tile_, options_.weight_patch);
    kernels_.weights(forward_.data(), out_stride_, area.width(), area.height());
    kernels_.weights(backward_.data(), out_stride_, area.width(), area.height());
    if (options_.symmetric) {
        kernels_.symmetric(forward_.data(), backward_.data(), between_.data(), out_stride_,
                           area.width(), area.height());
    }
    if (options_.weight_patch > 0) {
        SmoothWeights(Inside(dx, dy), &forward_);
        SmoothWeights(Inside(-dx, -dy), &backward_);
    }
    if (options_.least_weight > 0) {
        for (float* plane : {forward(), backward()}) {
            kernels_.cut(plane, out_stride_, tile_.width(), tile_.height(), options_.least_weight);
        }
    }
}

void NlmWeights::ComputeAllWeights(float* out) {
    const int side = 2 * radius_ + 1, width = tile_.width();
    const auto plane_of = [&](int dx, int dy) {
        return out +
               ((dy + radius_) * side + dx + radius_) * static_cast<std::ptrdiff_t>(tile_.area());
    };
    const auto copy = [&](const float* from, float* to) {
        for (int y = 0; y < tile_.height(); ++y, from += out_stride_, to += width) {
            std::copy_n(from, width, to);
        }
    };
    std::fill_n(plane_of(0, 0), tile_.area(), 1.0f);
    for (const auto& [dx, dy] : HalfWindow(radius_)) {
        ComputeWeights(dx, dy);
        copy(forward(), plane_of(dx, dy));
        copy(backward(), plane_of(-dx, -dy));
    }
}

}  // namespace relume::denoise
