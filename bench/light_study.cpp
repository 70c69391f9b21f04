// How well lights are sampled: seconds and error at equal samples a pixel, on one thread.
//
//   relume-light-study SCENE WIDTH HEIGHT SPP REFERENCE.exr [DEPTH [SEEDS [REFERENCE_SPP [MAP]]]]
//
// MAP is an environment in the scene's folder.
// Prints CPU seconds, MrSE against the reference (mean over the seeds), their product, and the mean
// of the image over that of the reference. The reference is rendered with another seed and written
// if there is none.
#include <cstdio>
#include <cstdlib>
#include <filesystem>
#include <memory>

#include "core/film/film.h"
#include "core/image/exr.h"
#include "core/image/metrics.h"
#include "core/scene/formats.h"
#include "worker/render/render.h"

namespace relume {
namespace {

struct Rendered {
    Image image;
    double seconds = 0;
};

Rendered Render(const std::shared_ptr<const Scene>& scene, const RenderSettings& settings,
                std::uint32_t spp) {
    constexpr int kTile = 16;
    const render::Renderer renderer(scene, settings);
    Film film(settings.Window(), settings.width, settings.height);
    Rendered out;
    const CancelToken cancel;
    for (const TileRect& rect : CutIntoTiles(settings.Window(), kTile)) {
        const TileTask task{rect, std::vector<std::uint32_t>(rect.area(), 0),
                            std::vector<std::uint32_t>(rect.area(), spp)};
        const TileResult result = renderer.RenderTile(task, cancel);
        out.seconds += result.seconds;
        film.Merge(result);
    }
    out.image = Image(settings.width, settings.height, {"R", "G", "B"});
    for (int c = 0; c < 3; ++c) {
        for (std::size_t i = 0; i < film.pixel_count(); ++i) {
            out.image.Plane(c)[i] = film.Mean(i)[c];
        }
    }
    return out;
}

int Main(int argc, char** argv) {
    if (argc < 6) {
        std::fprintf(stderr,
                     "usage: relume-light-study SCENE WIDTH HEIGHT SPP REFERENCE.exr [DEPTH [SEEDS "
                     "[REFERENCE_SPP [MAP]]]]\n");
        return 2;
    }
    const std::filesystem::path file = argv[1], reference_file = argv[5];
    RenderSettings settings;
    settings.width = std::atoi(argv[2]);
    settings.height = std::atoi(argv[3]);
    const auto spp = static_cast<std::uint32_t>(std::atoi(argv[4]));
    settings.max_depth = argc > 6 ? std::atoi(argv[6]) : 8;
    const int seeds = argc > 7 ? std::atoi(argv[7]) : 1;
    const auto reference_spp = static_cast<std::uint32_t>(argc > 8 ? std::atoi(argv[8]) : 4096);

    LoadOptions options;
    options.environment = argc > 9 ? argv[9] : "";
    const auto files = MakeFolderSource(file.parent_path().string());
    const auto scene =
        std::make_shared<const Scene>(LoadScene(*files, file.filename().string(), options));
    if (!std::filesystem::exists(reference_file)) {
        settings.seed = 1000;
        const Rendered reference = Render(scene, settings, reference_spp);
        WriteExr(reference_file, reference.image);
        std::printf("reference of %u spp: %.1f s\n", reference_spp, reference.seconds);
    }
    const Image reference = ReadExr(reference_file);
    double seconds = 0, mrse = 0, trimmed = 0, energy = 0;
    for (int seed = 0; seed < seeds; ++seed) {
        settings.seed = static_cast<std::uint32_t>(seed);
        const Rendered test = Render(scene, settings, spp);
        const ImageError error = CompareImages(reference, test.image, "", "", false);
        seconds += test.seconds / seeds;
        mrse += error.mrse / seeds;
        trimmed += error.mrse_trimmed / seeds;
        energy += error.energy / seeds;
    }
    std::printf(
        "%s %ux%u %u spp: %.3f s, MrSE %.5f (trimmed %.5f), product %.5f (trimmed %.5f), "
        "energy %.4f\n",
        file.filename().c_str(), static_cast<unsigned>(settings.width),
        static_cast<unsigned>(settings.height), spp, seconds, mrse, trimmed, seconds * mrse,
        seconds * trimmed, energy);
    return 0;
}

}  // namespace
}  // namespace relume

int main(int argc, char** argv) { return relume::Main(argc, argv); }
