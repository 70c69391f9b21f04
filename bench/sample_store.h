#pragma once

#include <cstdint>
#include <filesystem>
#include <vector>

#include "core/film/moments.h"
#include "core/film/tile.h"
#include "worker/render/render.h"

namespace relume::bench {

// The first samples of every pixel of one frame, each kept apart. A sample is a pure function of
// scene, seed, pixel and index, so that whatever a sampler asks for can be answered from here: the
// film is the one that a farm would get. Features are kept of the first samples alone and come
// again after that.
class SampleStore {
  public:
    static constexpr std::uint32_t kFeatureSamples = 64;

    // Renders samples [0, spp) with `threads` threads. spp: even, at least
    // kFeatureSamples.
    static SampleStore Render(const render::Renderer& renderer, const TileRect& window,
                              std::uint32_t spp, int threads);
    // A file that Save wrote; false if there is none of that size.
    bool Load(const std::filesystem::path& file, const TileRect& window, std::uint32_t spp);
    void Save(const std::filesystem::path& file) const;

    const TileRect& window() const { return window_; }
    std::uint32_t spp() const { return spp_; }
    double render_seconds() const { return seconds_; }  // thread seconds that it took

    PixelSample Get(std::size_t pixel, std::uint32_t index) const;

    // What a worker answers. Beyond what is stored samples come again, in both halves their own.
    TileResult Answer(const TileTask& task) const;

  private:
    TileRect window_;
    std::uint32_t spp_ = 0;
    double seconds_ = 0;
    std::vector<float> color_;     // pixel, index, RGB and indirect luminance
    std::vector<float> features_;  // pixel, index, feature
};

}  // namespace relume::bench
