#pragma once

#include <cmath>
#include <cstdint>
#include <limits>
#include <span>
#include <vector>

#include "core/math/vec.h"

namespace relume {

// One sample of a pixel in full, for filters that look at samples rather than at their moments
// (random parameter filtering): 28 floats.
struct SampleRecord {
    struct Hit {
        Vec3f position, normal;  // world; the normal has unit length and faces the path
        Rgb albedo;              // of the surface
    };

    float x = 0, y = 0;  // in the pixel, [0, 1)
    Rgb radiance;
    // The path's first two vertices. All 0 if there is none; a path that leaves the scene at once
    // has a first one on the far side of its bounding sphere, without normal, and with what it sees
    // there, clamped to 1, as albedo.
    Hit hits[2];
    // Numbers in [0, 1) that the sample was drawn with: 2 of the lens, or of the first vertex's
    // direction if there is none; time 1; 2 of the first vertex's place on a light. 0: not used.
    float random[5] = {};

    // In the place of a sample with a NaN or an infinity.
    static SampleRecord Bad() {
        SampleRecord record;
        record.radiance.x = std::numeric_limits<float>::quiet_NaN();
        return record;
    }
    bool bad() const { return !IsFinite(radiance); }
};
inline constexpr std::size_t kSampleRecordFloats = 28;
static_assert(sizeof(SampleRecord) == kSampleRecordFloats * sizeof(float), "sent as it lies");

// The records of a frame's samples. Not thread-safe.
class SampleRecords {
  public:
    explicit SampleRecords(std::size_t pixels) : pixels_(pixels) {}

    std::size_t pixel_count() const { return pixels_.size(); }
    // In order of their global index, from 0 on, bad ones among them.
    std::span<const SampleRecord> Of(std::size_t pixel) const { return pixels_[pixel]; }
    void Append(std::size_t pixel, std::span<const SampleRecord> records) {
        // To the last byte: growing by doublings would take twice the memory.
        pixels_[pixel].reserve(pixels_[pixel].size() + records.size());
        pixels_[pixel].insert(pixels_[pixel].end(), records.begin(), records.end());
    }

  private:
    std::vector<std::vector<SampleRecord>> pixels_;
};

}  // namespace relume
