#include "core/film/film.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>

#include "core/base/byte_stream.h"
#include "core/base/error.h"
#include "core/film/merge_moments.h"
#include "core/image/metrics.h"

namespace relume {
namespace {

// Pixels [begin, end) of a block lie side by side in the film, from `at` on.
struct Run {
    std::size_t at, begin, end;
};

// Of pixel k of the result, bad ones included.
std::size_t SamplesOf(const TileResult& result, std::size_t k) {
    const std::size_t n = result.pixels.size();
    return static_cast<std::size_t>(result.planes[kCountA * n + k] +
                                    result.planes[kCountB * n + k] +
                                    result.planes[kBadCount * n + k]);
}

}  // namespace

Film::Film(const TileRect& window, int display_width, int display_height)
    : window_(window),
      display_width_(display_width),
      display_height_(display_height),
      data_(window.area() * kFilmChannelCount, 0.0f) {}

std::size_t Film::IndexOf(const TileResult& result, std::size_t k) const {
    const TileRect& r = result.rect;
    const int pixel = static_cast<int>(result.pixels[k]);
    const int x = r.x0 - window_.x0 + pixel % r.width();
    const int y = r.y0 - window_.y0 + pixel / r.width();
    return static_cast<std::size_t>(y) * static_cast<std::size_t>(width()) +
           static_cast<std::size_t>(x);
}

void Film::Merge(const TileResult& result) {
    const TileRect& r = result.rect;
    if (r.empty() || !window_.Contains(r)) {
        ThrowInvalidArgument(
            fmt::format("tile {},{}..{},{} is not in the film", r.x0, r.y0, r.x1, r.y1));
    }
    const std::size_t n = result.pixels.size();
    if (result.planes.size() != n * kFilmChannelCount) {
        ThrowInvalidArgument(fmt::format("tile result has {} values for {} pixels, {} are due",
                                         result.planes.size(), n, n * kFilmChannelCount));
    }
    for (std::size_t k = 0; k < n; ++k) {
        if (result.pixels[k] >= r.area() || (k > 0 && result.pixels[k] <= result.pixels[k - 1])) {
            ThrowInvalidArgument("pixel indices of a tile result must rise and lie in the tile");
        }
    }
    std::size_t records = 0;
    for (std::size_t k = 0; k < n && !result.samples.empty(); ++k) {
        records += SamplesOf(result, k);
    }
    if (records != result.samples.size()) {
        ThrowInvalidArgument(fmt::format("tile result has {} samples, its pixels count {}",
                                         result.samples.size(), records));
    }
    MergeSamples(result);
    // In blocks: loops over pixels of one channel, read and written in runs that lie side by side.
    MomentsBlock mine{}, other{};
    std::vector<Run> runs;
    for (std::size_t begin = 0; begin < n; begin += kMomentsBlock) {
        const std::size_t count = std::min(kMomentsBlock, n - begin);
        runs.clear();
        for (std::size_t k = 0; k < count; ++k) {
            const std::size_t at = IndexOf(result, begin + k);
            if (runs.empty() || at != runs.back().at + (k - runs.back().begin)) {
                runs.push_back({at, k, k});
            }
            runs.back().end = k + 1;
        }
        for (std::size_t c = 0; c < kFilmChannelCount; ++c) {
            const float* plane = data_.data() + c * pixel_count();
            for (const Run& run : runs) {
                for (std::size_t k = run.begin; k < run.end; ++k) {
                    mine[c][k] = plane[run.at + (k - run.begin)];
                }
            }
            std::copy_n(result.planes.data() + c * n + begin, count, other[c].data());
        }
        MergeMoments(other, &mine);
        for (std::size_t c = 0; c < kFilmChannelCount; ++c) {
            float* plane = data_.data() + c * pixel_count();
            for (const Run& run : runs) {
                for (std::size_t k = run.begin; k < run.end; ++k) {
                    plane[run.at + (k - run.begin)] = mine[c][k];
                }
            }
        }
    }
}

void Film::MergeSamples(const TileResult& result) {
    if (result.samples.empty()) {
        return;
    }
    if (!samples_) {
        samples_ = std::make_shared<SampleRecords>(pixel_count());
    }
    std::span<const SampleRecord> left = result.samples;
    for (std::size_t k = 0; k < result.pixels.size(); ++k) {
        const std::size_t count = SamplesOf(result, k);
        samples_->Append(IndexOf(result, k), left.first(count));
        left = left.subspan(count);
    }
}

template <typename F>
void Film::ForEachRow(const TileRect& rect, F&& body) const {
    for (int y = rect.y0; y < rect.y1; ++y) {
        body(static_cast<std::size_t>(y - window_.y0) * static_cast<std::size_t>(width()) +
                 static_cast<std::size_t>(rect.x0 - window_.x0),
             static_cast<std::size_t>(rect.width()));
    }
}

std::string Film::SaveTile(const TileRect& rect) const {
    ByteWriter out;
    const std::size_t values = rect.area() * kFilmChannelCount;
    out.Reserve(values * sizeof(float) + 2 * sizeof(std::uint64_t));
    out.Put<std::uint64_t>(values);  // as PutAll
    for (int c = 0; c < kFilmChannelCount; ++c) {
        const std::span<const float> plane = Plane(c);
        ForEachRow(rect, [&](std::size_t begin, std::size_t count) {
            out.PutValues(plane.subspan(begin, count));
        });
    }
    out.Put<std::uint8_t>(samples_ ? 1 : 0);
    if (samples_) {
        ForEachRow(rect, [&](std::size_t begin, std::size_t count) {
            for (std::size_t i = begin; i < begin + count; ++i) {
                const auto records = samples_->Of(i);
                out.PutAll(std::vector<SampleRecord>(records.begin(), records.end()));
            }
        });
    }
    return out.Take();
}

void Film::LoadTile(const TileRect& rect, std::string_view bytes) {
    ByteReader in(bytes);
    const auto planes = in.GetAll<float>();
    if (planes.size() != rect.area() * kFilmChannelCount) {
        throw Error(ErrorCode::kDataLoss,
                    fmt::format("saved tile has {} values, {} are due", planes.size(),
                                rect.area() * kFilmChannelCount));
    }
    auto from = planes.begin();
    for (std::size_t c = 0; c < kFilmChannelCount; ++c) {
        float* plane = data_.data() + c * pixel_count();
        ForEachRow(rect, [&](std::size_t begin, std::size_t count) {
            std::copy_n(from, count, plane + begin);
            from += static_cast<std::ptrdiff_t>(count);
        });
    }
    if (in.Get<std::uint8_t>() != 0) {
        if (!samples_) {
            samples_ = std::make_shared<SampleRecords>(pixel_count());
        }
        ForEachRow(rect, [&](std::size_t begin, std::size_t count) {
            for (std::size_t i = begin; i < begin + count; ++i) {
                samples_->Append(i, in.GetAll<SampleRecord>());
            }
        });
    }
    in.End();
}

std::uint32_t Film::NextIndex(std::size_t i) const {
    return static_cast<std::uint32_t>(Plane(kCountA)[i] + Plane(kCountB)[i] + Plane(kBadCount)[i]);
}

Rgb Film::Mean(std::size_t i) const {
    const float a = Plane(kCountA)[i], b = Plane(kCountB)[i];
    if (a + b == 0) {
        return {};
    }
    Rgb mean;
    for (int c = 0; c < 3; ++c) {
        mean[c] = (a * Plane(kMeanA + c)[i] + b * Plane(kMeanB + c)[i]) / (a + b);
    }
    return mean;
}

Rgb Film::MeanVariance(std::size_t i) const {
    const float a = Plane(kCountA)[i], b = Plane(kCountB)[i];
    Rgb variance;
    if (a + b == 0) {
        return variance;
    }
    for (int c = 0; c < 3; ++c) {
        const float va = a > 1 ? Plane(kM2A + c)[i] * a / (a - 1) : 0;
        const float vb = b > 1 ? Plane(kM2B + c)[i] * b / (b - 1) : 0;
        variance[c] = (va + vb) / ((a + b) * (a + b));
    }
    return variance;
}

Rgb Film::HalfVariance(std::size_t i) const {
    const float a = Plane(kCountA)[i], b = Plane(kCountB)[i];
    Rgb variance;
    if (a == 0 || b == 0) {
        return variance;
    }
    const float scale = a * b / ((a + b) * (a + b));
    for (int c = 0; c < 3; ++c) {
        const float d = Plane(kMeanA + c)[i] - Plane(kMeanB + c)[i];
        variance[c] = d * d * scale;
    }
    return variance;
}

double Film::EstimateRelMSE(std::size_t i) const {
    const Rgb mean = Mean(i), variance = HalfVariance(i);
    double sum = 0;
    for (int c = 0; c < 3; ++c) {
        sum += variance[c] / (static_cast<double>(mean[c]) * mean[c] + kRelMSEEpsilon);
    }
    return sum / 3;
}

double Film::EstimateRelMSE() const {
    double sum = 0;
    for (std::size_t i = 0; i < pixel_count(); ++i) {
        sum += EstimateRelMSE(i);
    }
    return pixel_count() > 0 ? sum / static_cast<double>(pixel_count()) : 0;
}

double Film::TotalSamples() const {
    double sum = 0;
    for (std::size_t i = 0; i < pixel_count(); ++i) {
        sum += SampleCount(i);
    }
    return sum;
}

double Film::TotalBadSamples() const {
    double sum = 0;
    for (const float bad : Plane(kBadCount)) {
        sum += bad;
    }
    return sum;
}

}  // namespace relume
