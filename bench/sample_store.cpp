#include "bench/sample_store.h"

#include <algorithm>
#include <atomic>
#include <fstream>
#include <mutex>
#include <thread>

#include "core/base/cancel_token.h"

namespace relume::bench {
namespace {

constexpr int kTileSize = 32;

}  // namespace

SampleStore SampleStore::Render(const render::Renderer& renderer, const TileRect& window,
                                std::uint32_t spp, int threads) {
    SampleStore store;
    store.window_ = window;
    store.spp_ = spp;
    store.color_.resize(window.area() * spp * 4);
    store.features_.resize(window.area() * kFeatureSamples * kFeatureCount);
    const std::vector<TileRect> tiles = CutIntoTiles(window, kTileSize);
    const CancelToken never;
    std::atomic<std::size_t> next{0};
    std::mutex mutex;
    std::vector<std::jthread> running;
    for (int t = 0; t < threads; ++t) {
        running.emplace_back([&] {
            for (std::size_t i = next++; i < tiles.size(); i = next++) {
                const TileRect& rect = tiles[i];
                double seconds = 0;
                for (std::uint32_t index = 0; index < spp; ++index) {
                    const TileTask task{rect, std::vector<std::uint32_t>(rect.area(), index),
                                        std::vector<std::uint32_t>(rect.area(), 1)};
                    const TileResult result = renderer.RenderTile(task, never);
                    seconds += result.seconds;
                    const std::size_t n = result.pixels.size();
                    const auto at = [&](int channel, std::size_t k) {
                        return result.planes[static_cast<std::size_t>(channel) * n + k];
                    };
                    const int half = static_cast<int>(index & 1);
                    for (std::size_t k = 0; k < n; ++k) {
                        const auto x = static_cast<std::size_t>(rect.x0 - window.x0) +
                                       k % static_cast<std::size_t>(rect.width());
                        const auto y = static_cast<std::size_t>(rect.y0 - window.y0) +
                                       k / static_cast<std::size_t>(rect.width());
                        const std::size_t pixel = y * static_cast<std::size_t>(window.width()) + x;
                        float* color = &store.color_[(pixel * spp + index) * 4];
                        for (int c = 0; c < 3; ++c) {
                            color[c] = at(half == 0 ? kMeanA + c : kMeanB + c, k);
                        }
                        color[3] = at(kMaxLuminance, k);
                        for (int f = 0; f < kFeatureCount && index < kFeatureSamples; ++f) {
                            store.features_[(pixel * kFeatureSamples + index) * kFeatureCount +
                                            static_cast<std::size_t>(f)] =
                                at((half == 0 ? kFeatureMeanA : kFeatureMeanB) + f, k);
                        }
                    }
                }
                const std::scoped_lock lock(mutex);
                store.seconds_ += seconds;
            }
        });
    }
    running.clear();
    return store;
}

bool SampleStore::Load(const std::filesystem::path& file, const TileRect& window,
                       std::uint32_t spp) {
    const std::size_t color = window.area() * spp * 4,
                      features = window.area() * kFeatureSamples * kFeatureCount;
    std::error_code none;
    if (std::filesystem::file_size(file, none) !=
            sizeof(double) + sizeof(float) * (color + features) ||
        none) {
        return false;
    }
    window_ = window;
    spp_ = spp;
    color_.resize(color);
    features_.resize(features);
    std::ifstream in(file, std::ios::binary);
    in.read(reinterpret_cast<char*>(&seconds_), sizeof(seconds_));
    in.read(reinterpret_cast<char*>(color_.data()),
            static_cast<std::streamsize>(color * sizeof(float)));
    in.read(reinterpret_cast<char*>(features_.data()),
            static_cast<std::streamsize>(features * sizeof(float)));
    return in.good();
}

void SampleStore::Save(const std::filesystem::path& file) const {
    const std::filesystem::path part = file.string() + ".part";
    std::ofstream out(part, std::ios::binary);
    out.write(reinterpret_cast<const char*>(&seconds_), sizeof(seconds_));
    out.write(reinterpret_cast<const char*>(color_.data()),
              static_cast<std::streamsize>(color_.size() * sizeof(float)));
    out.write(reinterpret_cast<const char*>(features_.data()),
              static_cast<std::streamsize>(features_.size() * sizeof(float)));
    out.close();
    std::filesystem::rename(part, file);
}

PixelSample SampleStore::Get(std::size_t pixel, std::uint32_t index) const {
    PixelSample sample;
    const float* color = &color_[(pixel * spp_ + index) * 4];
    sample.radiance = {color[0], color[1], color[2]};
    sample.indirect_luminance = color[3];
    const float* features =
        &features_[(pixel * kFeatureSamples + index % kFeatureSamples) * kFeatureCount];
    std::copy_n(features, kFeatureCount, sample.features.begin());
    return sample;
}

TileResult SampleStore::Answer(const TileTask& task) const {
    TileResult result;
    result.rect = task.rect;
    std::vector<PixelMoments> moments;
    for (std::size_t k = 0; k < task.count.size(); ++k) {
        if (task.count[k] == 0) {
            continue;
        }
        const auto width = static_cast<std::size_t>(task.rect.width());
        const auto x = static_cast<std::size_t>(task.rect.x0 - window_.x0) + k % width;
        const auto y = static_cast<std::size_t>(task.rect.y0 - window_.y0) + k / width;
        const std::size_t pixel = y * static_cast<std::size_t>(window_.width()) + x;
        result.pixels.push_back(static_cast<std::uint32_t>(k));
        moments.emplace_back();
        for (std::uint32_t n = 0; n < task.count[k]; ++n) {
            moments.back().Add(task.first[k] + n, Get(pixel, (task.first[k] + n) % spp_));
        }
    }
    result.planes.resize(kFilmChannelCount * moments.size());
    for (std::size_t k = 0; k < moments.size(); ++k) {
        moments[k].Store(result.planes.data() + k, moments.size());
    }
    return result;
}

}  // namespace relume::bench
