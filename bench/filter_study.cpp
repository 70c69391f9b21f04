// relume-filter-study: what filters make of the same samples, on one scene.
//
// Samples are rendered once and kept (sample_store.h); the first of each pixel are folded into a
// film, which is the one of `relume render --sampler uniform`. Error is measured against the mean
// of all samples of the other seeds, whose own error is subtracted and told (not from SSIM and
// FLIP). Writes a line of JSON for each seed, number of samples and filter.
#include <fmt/format.h>
#include <sys/resource.h>

#include <CLI/CLI.hpp>
#include <algorithm>
#include <chrono>
#include <cstdio>
#include <limits>
#include <memory>
#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "bench/contact_sheet.h"
#include "bench/study_scene.h"
#include "bench/truth.h"
#include "core/base/error.h"
#include "core/base/files.h"
#include "core/base/parallel.h"
#include "core/image/metrics.h"
#include "server/denoise/denoiser.h"

namespace relume::bench {
namespace {

using Json = nlohmann::ordered_json;

// A filter that is quicker than this, in CPU seconds, runs several times, and the least counts.
constexpr double kQuick = 0.2;
constexpr int kRepeats = 3;

struct Options {
    StudyScene scene;
    int judged = 2;
    std::vector<int> spp{4, 8, 16, 32, 128};
    std::vector<std::string> filters{"none"};
    std::string sheet;
};

double UserSeconds() {
    rusage usage{};
    getrusage(RUSAGE_SELF, &usage);
    return static_cast<double>(usage.ru_utime.tv_sec) +
           1e-6 * static_cast<double>(usage.ru_utime.tv_usec);
}

struct Timed {
    denoise::Result result;
    double wall = std::numeric_limits<double>::max(), cpu = wall;
};

Timed RunTimed(const denoise::Denoiser& denoiser, const denoise::Frame& frame) {
    Timed out;
    double total = 0;
    for (int k = 0; k == 0 || (k < kRepeats && total < kQuick); ++k) {
        const auto start = std::chrono::steady_clock::now();
        const double user = UserSeconds();
        out.result = denoise::RunDenoiser(denoiser, frame, {});
        const double wall =
            std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
        out.wall = std::min(out.wall, wall);
        out.cpu = std::min(out.cpu, UserSeconds() - user);
        total += out.cpu;
    }
    return out;
}

template <class Value>
Image MakeImage(const TileRect& window, Value value) {
    Image image(window.width(), window.height(), {"R", "G", "B"});
    for (int c = 0; c < 3; ++c) {
        const auto plane = image.Plane(c);
        for (std::size_t i = 0; i < plane.size(); ++i) {
            plane[i] = value(i, c);
        }
    }
    return image;
}

std::array<denoise::Plane, 3> Planes(const Image& image) {
    std::array<denoise::Plane, 3> planes;
    for (int c = 0; c < 3; ++c) {
        const auto plane = image.Plane(c);
        planes[static_cast<std::size_t>(c)].assign(plane.begin(), plane.end());
    }
    return planes;
}

// The film of the first samples of every pixel.
Film FoldSamples(const SampleStore& store, std::uint32_t spp) {
    Film film(store.window(), store.window().width(), store.window().height());
    const std::size_t pixels = store.window().area();
    film.Merge(store.Answer({store.window(), std::vector<std::uint32_t>(pixels, 0),
                             std::vector<std::uint32_t>(pixels, spp)}));
    return film;
}

// Every filter on one seed's samples; the images go to `sheet`, if there is one.
void RunSeed(const Options& options, const SampleStore& store, const Truth& truth, int seed,
             int spp, std::vector<SheetImage>* sheet) {
    const denoise::Frame frame =
        denoise::FrameFromFilm(FoldSamples(store, static_cast<std::uint32_t>(spp)));
    const Image reference =
        MakeImage(store.window(), [&](std::size_t i, int c) { return truth.mean[i][c]; });
    for (const std::string& filter : options.filters) {
        const auto denoiser = denoise::MakeDenoiser(filter);
        Json line{{"scene", options.scene.name},
                  {"seed", seed},
                  {"spp", spp},
                  {"filter", filter},
                  {"pixels", frame.pixel_count()}};
        try {
            const Timed timed = RunTimed(*denoiser, frame);
            const auto& color = timed.result.color;
            const Score score = Compare(truth, [&](std::size_t i, int c) { return color[c][i]; });
            const Image image =
                MakeImage(store.window(), [&](std::size_t i, int c) { return color[c][i]; });
            const ImageError error = CompareImages(reference, image);
            line.update(Json{{"mrse", score.mrse},
                             {"trimmed", score.trimmed},
                             {"relmse", score.relmse},
                             {"ssim", error.ssim},
                             {"flip", error.flip},
                             {"energy", score.energy},
                             {"cpu_seconds", timed.cpu},
                             {"wall_seconds", timed.wall},
                             {"notes", timed.result.notes}});
            if (const auto choice = denoiser->Choose(frame, {})) {
                line["taken"] = choice->denoiser->Describe();
                for (const auto& c : choice->candidates) {
                    line["candidates"][c.filter] = {c.relmse, c.above_best, c.uncertainty};
                }
            }
            if (sheet != nullptr) {
                sheet->push_back({filter, fmt::format("MrSE {:.3g}", score.mrse), Planes(image)});
            }
        } catch (const Error& error) {
            line["error"] = error.what();
        }
        fmt::print("{}\n", line.dump());
        std::fflush(stdout);
    }
    if (sheet != nullptr) {
        const RgbPixels pixels = DrawContactSheet(
            fmt::format("{}, {} samples a pixel", options.scene.name, spp), store.window().width(),
            store.window().height(), *sheet, {"reference", "", Planes(reference)});
        WriteFileAtomically(options.sheet, EncodePng(pixels));
    }
}

void Run(const Options& options) {
    SetThreadCount(options.scene.threads);
    for (const std::string& filter : options.filters) {
        denoise::MakeDenoiser(filter);  // A wrong name is told before anything takes long.
    }
    const std::vector<SampleStore> stores = LoadSamples(options.scene);
    const int judged = std::min(options.judged, options.scene.seeds);
    const std::vector<Truth> truths = FindTruths(stores, static_cast<std::size_t>(judged));
    for (int seed = 0; seed < judged; ++seed) {
        const SampleStore& store = stores[static_cast<std::size_t>(seed)];
        const Truth& truth = truths[static_cast<std::size_t>(seed)];
        fmt::print("{}\n", Json{{"scene", options.scene.name},
                                {"seed", seed},
                                {"floor",
                                 {{"mrse", truth.error.mrse},
                                  {"trimmed", truth.error.trimmed},
                                  {"relmse", truth.error.relmse}}}}
                               .dump());
        for (const int spp : options.spp) {
            if (spp < 1 || static_cast<std::uint32_t>(spp) > store.spp()) {
                ThrowInvalidArgument(
                    fmt::format("--spp {}: must be 1 to {}, the samples stored", spp, store.spp()));
            }
            const bool first = seed == 0 && spp == options.spp.front();
            std::vector<SheetImage> sheet;
            RunSeed(options, store, truth, seed, spp,
                    first && !options.sheet.empty() ? &sheet : nullptr);
        }
    }
}

int Main(int argc, char** argv) {
    Options options;
    CLI::App app("Filters compared on the same samples.");
    AddSceneOptions(&app, &options.scene);
    app.add_option("--judged", options.judged,
                   "seeds whose images are filtered; all are in the references");
    app.add_option("--spp", options.spp)->delimiter(',');
    app.add_option("--filter", options.filters);
    app.add_option("--sheet", options.sheet,
                   "a contact sheet (.png) of the first seed and number of samples");
    CLI11_PARSE(app, argc, argv);
    try {
        Run(options);
    } catch (const std::exception& error) {
        std::fprintf(stderr, "relume-filter-study: %s\n", error.what());
        return 1;
    }
    return 0;
}

}  // namespace
}  // namespace relume::bench

int main(int argc, char** argv) { return relume::bench::Main(argc, argv); }
