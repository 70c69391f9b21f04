#include "server/denoise/nlm_weights.h"

#include <algorithm>

namespace relume::denoise {
namespace {

std::ptrdiff_t RoundUp(int n) { return (n + kNlmLanes - 1) / kNlmLanes * kNlmLanes; }

TileRect Grow(const TileRect& r, int by) { return {r.x0 - by, r.y0 - by, r.x1 + by, r.y1 + by}; }

TileRect Intersect(const TileRect& a, const TileRect& b) {
    return {std::max(a.x0, b.x0), std::max(a.y0, b.y0), std::min(a.x1, b.x1), std::min(a.y1, b.y1)};
}

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
      kernels_(kernels) {
    const int outer = 2 * (options.weight_patch + options.patch);
    guide_stride_ = RoundUp(max_width + 2 * halo_);
    guide_size_ = static_cast<std::size_t>(guide_stride_ * (max_height + 2 * halo_) + kNlmLanes);
    guide_.resize(guide_size_ * 2 * kNlmChannels);
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
    row_.resize(static_cast<std::size_t>(RoundUp(max_width + outer) + kNlmLanes));
    across_.resize(row_.size());
    down_.resize(static_cast<std::size_t>(max_height + outer));
}

void NlmWeights::Load(const NlmGuide& guide, const TileRect& tile) {
    image_width_ = guide.width;
    image_height_ = guide.height;
    tile_ = tile;
    channels_ = static_cast<int>(guide.value.size());
    const TileRect area = Grow(tile, halo_);
    const TileRect inside = Intersect(area, {0, 0, guide.width, guide.height});
    for (int c = 0; c < channels_; ++c) {
        for (int part = 0; part < 2; ++part) {
            const Plane& plane =
                *(part == 0 ? guide.value : guide.variance)[static_cast<std::size_t>(c)];
            const float scale = part == 0 ? 1 : guide.variance_scale;
            float* to =
                guide_.data() + static_cast<std::size_t>(part * kNlmChannels + c) * guide_size_;
            if (!(inside == area)) {
                std::fill_n(to, guide_size_, 0.0f);
            }
            for (int y = inside.y0; y < inside.y1; ++y) {
                const float* from = plane.data() + static_cast<std::ptrdiff_t>(y) * guide.width;
                float* row = to + (y - area.y0) * guide_stride_ - area.x0;
                for (int x = inside.x0; x < inside.x1; ++x) {
                    row[x] = from[x] * scale;
                }
            }
        }
    }
}

// The pixels of the image whose neighbour at (dx, dy) lies in it too.
TileRect NlmWeights::Inside(int dx, int dy) const {
    return {std::max(0, -dx), std::max(0, -dy), std::min(image_width_, image_width_ - dx),
            std::min(image_height_, image_height_ - dy)};
}

void NlmWeights::MaskOutside(float* plane, std::ptrdiff_t stride, const TileRect& area,
                             const TileRect& keep, float outside) const {
    const TileRect inside = Intersect(area, keep);
    if (inside == area) {
        return;
    }
    for (int y = area.y0; y < area.y1; ++y, plane += stride) {
        if (y < inside.y0 || y >= inside.y1 || inside.empty()) {
            std::fill_n(plane, area.width(), outside);
        } else {
            std::fill(plane, plane + (inside.x0 - area.x0), outside);
            std::fill(plane + (inside.x1 - area.x0), plane + area.width(), outside);
        }
    }
}

// One over the number of columns and rows within `patch` of each that lie in `keep`.
void NlmWeights::FillInverseCounts(const TileRect& area, const TileRect& keep, int patch) {
    const auto fill = [patch](int from, int to, int first, int last, float* out) {
        for (int x = from; x < to; ++x) {
            const int count = std::min(x + patch + 1, last) - std::max(x - patch, first);
            *out++ = count > 0 ? 1.0f / static_cast<float>(count) : 0.0f;
        }
    };
    fill(area.x0, area.x1, keep.x0, keep.x1, across_.data());
    fill(area.y0, area.y1, keep.y0, keep.y1, down_.data());
}

NlmPair NlmWeights::PairAt(const TileRect& area, int dx, int dy, int first, int count) const {
    NlmPair pair{};
    const std::ptrdiff_t at =
        (area.y0 - tile_.y0 + halo_) * guide_stride_ + area.x0 - tile_.x0 + halo_;
    for (int c = 0; c < count; ++c) {
        const float* value = guide_.data() + static_cast<std::size_t>(first + c) * guide_size_;
        pair.value[c] = value + at;
        pair.variance[c] = value + kNlmChannels * guide_size_ + at;
    }
    pair.channels = count;
    pair.stride = guide_stride_;
    pair.shift = dy * guide_stride_ + dx;
    pair.alpha = options_.alpha;
    pair.k_squared = options_.k * options_.k;
    pair.epsilon = options_.epsilon;
    pair.largest = options_.largest;
    return pair;
}

// Mean over the patch of the plane `raw`, which holds the distances of `raw_area`, for the tile and
// its margin; `keep` is where they are distances between pixels of the image.
void NlmWeights::BoxInto(const float* raw, const TileRect& raw_area, const TileRect& keep,
                         bool keep_larger, std::vector<float>* out) {
    const TileRect area = Grow(tile_, options_.weight_patch);
    FillInverseCounts(area, keep, options_.patch);
    kernels_.box(raw + (area.y0 - raw_area.y0) * raw_stride_ + area.x0 - raw_area.x0, raw_stride_,
                 options_.patch, area.width(), area.height(), across_.data(), down_.data(),
                 keep_larger, row_.data(), out->data(), out_stride_);
    MaskOutside(out->data(), out_stride_, area, keep, kNlmOutside);
}

void NlmWeights::ComputeDistances(int dx, int dy) {
    const TileRect patched = Grow(tile_, options_.weight_patch + options_.patch);
    // Pairs (q, q + d): forward has q in the tile, backward q + d.
    const TileRect pairs = {patched.x0 - std::max(dx, 0), patched.y0 - std::max(dy, 0),
                            patched.x1 - std::min(dx, 0), patched.y1 - std::min(dy, 0)};
    const TileRect moved = {pairs.x0 + dx, pairs.y0 + dy, pairs.x1 + dx, pairs.y1 + dy};
    const TileRect ahead = Inside(dx, dy), behind = Inside(-dx, -dy);
    const TileRect both = Intersect(ahead, behind);
    const int step = options_.least_of_channels ? 1 : channels_;
    for (int c = 0; c < channels_; c += step) {
        kernels_.pair(PairAt(pairs, dx, dy, c, step), pairs.width(), pairs.height(), raw_[0].data(),
                      raw_[1].data(), raw_stride_);
        MaskOutside(raw_[0].data(), raw_stride_, pairs, ahead, 0);
        MaskOutside(raw_[1].data(), raw_stride_, pairs, ahead, 0);
        BoxInto(raw_[0].data(), pairs, ahead, c > 0, &forward_);
        BoxInto(raw_[1].data(), moved, behind, c > 0, &backward_);
        if (options_.symmetric) {
            kernels_.between(PairAt(patched, dx, dy, c, step), patched.width(), patched.height(),
                             raw_[0].data(), raw_stride_);
            MaskOutside(raw_[0].data(), raw_stride_, patched, both, 0);
            BoxInto(raw_[0].data(), patched, both, c > 0, &between_);
        }
    }
}

// Replaces the weights by their mean over the patch, of those that have a neighbour in the image.
void NlmWeights::SmoothWeights(const TileRect& keep, std::vector<float>* plane) {
    FillInverseCounts(tile_, keep, options_.weight_patch);
    const std::ptrdiff_t at = options_.weight_patch * (out_stride_ + 1);
    kernels_.box(plane->data() + at, out_stride_, options_.weight_patch, tile_.width(),
                 tile_.height(), across_.data(), down_.data(), false, row_.data(),
                 smooth_.data() + at, out_stride_);
    MaskOutside(smooth_.data() + at, out_stride_, tile_, keep, 0);
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

std::vector<std::pair<int, int>> HalfWindow(int radius) {
    std::vector<std::pair<int, int>> offsets;
    for (int dy = 0; dy <= radius; ++dy) {
        for (int dx = dy == 0 ? 1 : -radius; dx <= radius; ++dx) {
            offsets.emplace_back(dx, dy);
        }
    }
    return offsets;
}

}  // namespace relume::denoise
