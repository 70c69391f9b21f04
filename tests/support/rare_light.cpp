#include "tests/support/rare_light.h"

#include <array>
#include <memory>
#include <vector>

#include "core/base/cancel_token.h"
#include "core/base/parallel.h"
#include "core/scene/formats.h"
#include "server/jobs/planner.h"
#include "tests/support/local_farm.h"
#include "worker/render/render.h"

namespace relume::test {
namespace {

constexpr double kMean = 0.55;
constexpr int kDepth = 3;  // wall, pane, lamp

struct Third {
    double pixels = 0, samples = 0, heap = 0;  // sums of means, counts, and of their products
};

}  // namespace

RareLight MeasureRareLight(const std::string& chance, const std::string& sampler, int spp, int size,
                           int seeds) {
    const auto files = MakeFolderSource(RELUME_SOURCE_DIR "/scenes/rare_light");
    const auto built = std::make_shared<const render::BuiltScene>(
        LoadScene(*files, "rare_light_" + chance + ".gltf", {}));
    const TileRect window{0, 0, size, size};
    std::vector<std::array<Third, 3>> found(static_cast<std::size_t>(seeds));
    ParallelFor(0, found.size(), 1, [&](std::size_t first, std::size_t last) {
        for (std::size_t seed = first; seed < last; ++seed) {
            RenderSettings settings;
            settings.width = settings.height = size;
            settings.max_depth = kDepth;
            settings.seed = static_cast<std::uint32_t>(seed);
            const render::Renderer renderer(built, settings);
            const CancelToken never;
            const Sampled sampled = RunJob(
                window, jobs::MakePlanner(sampler), static_cast<std::uint64_t>(spp) * window.area(),
                {}, [&](const TileTask& task) { return renderer.RenderTile(task, never); });
            for (std::size_t i = 0; i < window.area(); ++i) {
                const auto x = i % static_cast<std::size_t>(size);
                Third& third = found[seed][3 * x / static_cast<std::size_t>(size)];
                const double mean = sampled.film->Mean(i).x, n = sampled.film->SampleCount(i);
                third.pixels += mean;
                third.samples += n;
                third.heap += n * mean;
            }
        }
    });
    RareLight out;
    const double pixels = static_cast<double>(window.area()) / 3;
    for (const auto& [noise, light, still] : found) {
        const double energy = light.pixels / pixels / kMean;
        out.energy.Add(energy);
        out.without_luck.Add(energy - (light.heap / light.samples / kMean - 1));
        out.samples.Add(light.samples / pixels);
        out.other[0].Add(noise.pixels / pixels / kMean);
        out.other[1].Add(still.pixels / pixels / kMean);
    }
    return out;
}

}  // namespace relume::test
