#include "server/denoise/rpf_rows.h"

#include <algorithm>
#include <cmath>
#include <limits>

namespace relume::denoise {
namespace {

bool IsGood(const SampleRecord& record) {
    bool finite = !record.bad() && std::isfinite(record.x) && std::isfinite(record.y);
    for (const auto& hit : record.hits) {
        finite = finite && IsFinite(hit.position) && IsFinite(hit.normal) && IsFinite(hit.albedo);
    }
    return finite && std::ranges::all_of(record.random, [](float u) { return std::isfinite(u); });
}

void CopyHit(const SampleRecord::Hit& hit, float* to) {
    for (const Vec3f& v : {hit.position, hit.normal, hit.albedo}) {
        for (int c = 0; c < 3; ++c) {
            *to++ = v[c];
        }
    }
}

}  // namespace

RpfRow RpfRowOf(const SampleRecord& record, const Rgb& color) {
    RpfRow row;
    float* to = row.values.data();
    CopyHit(record.hits[0], to + kRpfRowHit);
    CopyHit(record.hits[1], to + kRpfRowSecond);
    for (int c = 0; c < 3; ++c) {
        to[kRpfRowColor + static_cast<std::size_t>(c)] = color[c];
    }
    to[kRpfRowPlace] = record.x;
    to[kRpfRowPlace + 1] = record.y;
    std::copy_n(record.random, 5, to + kRpfRowRandom);
    return row;
}

RpfSamples RpfSamplesOf(const Frame& frame) {
    RpfSamples out;
    out.width = frame.width;
    out.height = frame.height;
    std::array<float, kRpfRowFloats> low, high;
    low.fill(std::numeric_limits<float>::max());
    high.fill(std::numeric_limits<float>::lowest());
    out.first.push_back(0);
    for (std::size_t i = 0; i < frame.pixel_count(); ++i) {
        for (const SampleRecord& record : frame.samples->Of(i)) {
            if (!IsGood(record)) {
                continue;
            }
            out.records.push_back(&record);
            const RpfRow row = RpfRowOf(record, record.radiance);
            for (std::size_t k = 0; k < kRpfRowFloats; ++k) {
                low[k] = std::min(low[k], row.values[k]);
                high[k] = std::max(high[k], row.values[k]);
            }
        }
        out.first.push_back(out.records.size());
    }
    for (std::size_t k = 0; k < kRpfRowFloats; ++k) {
        out.varies[k] = high[k] > low[k];
    }
    if (!out.records.empty()) {
        out.extent = Length(Vec3f{high[0] - low[0], high[1] - low[1], high[2] - low[2]});
    }
    return out;
}

void RpfRows::Copy(const RpfSamples& samples, const std::vector<Rgb>& colors, int x0, int y0,
                   int x1, int y1) {
    x0_ = x0;
    y0_ = y0;
    width_ = x1 - x0;
    first_.assign(1, 0);
    rows_.clear();
    for (int y = y0; y < y1; ++y) {
        for (int x = x0; x < x1; ++x) {
            const std::size_t pixel = samples.Index(x, y);
            for (std::size_t i = samples.first[pixel]; i < samples.first[pixel + 1]; ++i) {
                rows_.push_back(RpfRowOf(*samples.records[i], colors[i]));
            }
            first_.push_back(rows_.size());
        }
    }
}

}  // namespace relume::denoise
