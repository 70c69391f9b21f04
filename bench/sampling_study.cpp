// relume-sampling-study: how well samplers spend a number of samples, on one scene.
//
// Samples are pure functions of their index: each is rendered once and kept (sample_store.h), then
// every sampler takes what it asks for from there, and gets the film that a farm would give it.
// Error is measured against the mean of all samples of the other seeds, whose own error is
// subtracted and told. Writes a line of JSON for each seed, number of samples, sampler and filter.
#include <fmt/format.h>

#include <CLI/CLI.hpp>
#include <algorithm>
#include <chrono>
#include <cmath>
#include <cstdio>
#include <filesystem>
#include <memory>
#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "bench/sample_store.h"
#include "bench/scene_source.h"
#include "core/base/error.h"
#include "core/base/parallel.h"
#include "server/denoise/denoiser.h"
#include "server/denoise/error_estimate.h"
#include "server/denoise/halves.h"
#include "server/jobs/neyman.h"
#include "server/jobs/planner.h"
#include "server/rpc/filter_loop.h"
#include "tests/support/local_farm.h"

namespace relume::bench {
namespace {

using Json = nlohmann::ordered_json;
constexpr const char* kOracle = "oracle";

struct Options {
    std::string scene, environment, store, name;
    float environment_scale = 1, time = -1, shutter = -1;
    std::string size = "192x144";
    std::vector<float> look_from, look_at{0, 0, 0};
    float fov = 40;
    int depth = 0, threads = 2, seeds = 4;
    std::uint32_t stored = 512;
    std::vector<int> spp{16, 32, 64};
    std::vector<double> targets;
    std::vector<std::string> samplers{"uniform", "adaptive"}, filters{"none"};
};

double Since(std::chrono::steady_clock::time_point start) {
    return std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
}

// Per pixel and channel.
struct Truth {
    std::vector<Rgb> mean, floor;  // and the variance of that mean
    std::vector<Rgb> variance;     // of one sample
};

Truth FindTruth(const std::vector<SampleStore>& stores, std::size_t without) {
    const std::size_t pixels = stores[0].window().area();
    Truth truth{std::vector<Rgb>(pixels), std::vector<Rgb>(pixels), std::vector<Rgb>(pixels)};
    ParallelFor(0, pixels, 64, [&](std::size_t i0, std::size_t i1) {
        for (std::size_t i = i0; i < i1; ++i) {
            for (int c = 0; c < 3; ++c) {
                Moments means, all;
                for (std::size_t s = 0; s < stores.size(); ++s) {
                    Moments one;
                    for (std::uint32_t k = 0; k < stores[s].spp(); ++k) {
                        one.Add(stores[s].Get(i, k).radiance[c]);
                    }
                    all.Merge(one);
                    if (s != without) {
                        means.Add(one.mean);
                    }
                }
                truth.mean[i][c] = static_cast<float>(means.mean);
                truth.floor[i][c] = static_cast<float>(means.MeanVariance());
                truth.variance[i][c] = static_cast<float>(all.SampleVariance());
            }
        }
    });
    return truth;
}

struct Score {
    double mrse = 0, trimmed = 0, relmse = 0, energy = 0;
};

template <class Value>
Score Compare(const Truth& truth, Value value) {
    std::vector<double> errors(truth.mean.size());
    double sum = 0, reference = 0;
    Score score;
    for (std::size_t i = 0; i < errors.size(); ++i) {
        for (int c = 0; c < 3; ++c) {
            const double r = truth.mean[i][c], x = value(i, c),
                         e = (x - r) * (x - r) - truth.floor[i][c];
            errors[i] += e / (r * r + 0.001) / 3;
            score.relmse += e / (r * r + 0.01) / 3;
            sum += x;
            reference += r;
        }
    }
    const auto n = static_cast<double>(errors.size());
    score.relmse /= n;
    for (const double e : errors) {
        score.mrse += e / n;
    }
    std::sort(errors.begin(), errors.end());
    const std::size_t kept = errors.size() - errors.size() / 1000;
    for (std::size_t i = 0; i < kept; ++i) {
        score.trimmed += errors[i] / static_cast<double>(kept);
    }
    score.energy = reference > 0 ? sum / reference : 1;
    return score;
}

void Put(const char* what, const Score& score, Json* line) {
    (*line)[what] = {{"mrse", score.mrse},
                     {"trimmed", score.trimmed},
                     {"relmse", score.relmse},
                     {"energy", score.energy}};
}

// Counts in proportion to the true deviation relative to the true brightness (Neyman 1934), at
// least 2.
class Oracle final : public jobs::Planner {
  public:
    explicit Oracle(const Truth& truth) : deviation_(truth.mean.size()) {
        for (std::size_t i = 0; i < deviation_.size(); ++i) {
            double sum = 0;
            for (int c = 0; c < 3; ++c) {
                sum += truth.variance[i][c] / (truth.mean[i][c] * truth.mean[i][c] + 0.001) / 3;
            }
            deviation_[i] = static_cast<float>(std::sqrt(sum));
        }
    }
    std::string Describe() const override { return kOracle; }
    jobs::FilmView View() const override { return jobs::FilmView::kNothing; }
    jobs::Plan NextPass(const jobs::PlanInput& input) override {
        jobs::Plan plan;
        if (pass_++ == 0) {
            plan.counts.assign(deviation_.size(), 2);
            return plan;
        }
        // At most three times what is there: several rounds.
        const std::uint64_t share = pass_ < 5 ? input.budget / 4 : input.budget;
        plan.counts = jobs::ShareByDeviation(jobs::PlannedCounts(input), deviation_, share, pass_);
        if (std::all_of(plan.counts.begin(), plan.counts.end(),
                        [](std::uint32_t c) { return c == 0; })) {
            plan.counts.clear();
        }
        return plan;
    }

  private:
    std::vector<float> deviation_;
    std::uint32_t pass_ = 0;
};

jobs::Guide GuideOf(const jobs::Planner& planner, const std::string& filter) {
    return planner.Method() != nullptr ? server::MakeMethodGuide(planner.Method())
                                       : server::MakeGuide(filter);
}

void RunOne(const Options& options, const SampleStore& store, const Truth& truth, int seed, int spp,
            const std::string& sampler, const std::string& filter) {
    const TileRect& window = store.window();
    const auto denoiser = denoise::MakeDenoiser(filter);
    const CancelToken never;
    double guide_seconds = 0;
    std::shared_ptr<jobs::Planner> planner;
    if (sampler == kOracle) {
        planner = std::make_shared<Oracle>(truth);
    } else {
        planner = jobs::MakePlanner(sampler);
    }
    const jobs::Guide loop = GuideOf(*planner, filter);
    const jobs::Guide guide = [&](const Film& film, double samples) {
        const auto start = std::chrono::steady_clock::now();
        auto out = loop(film, samples);
        guide_seconds += Since(start);
        return out;
    };
    const std::uint64_t budget = static_cast<std::uint64_t>(spp) * window.area();
    std::uint64_t beyond_store = 0;
    const test::Sampled sampled = test::RunJob(
        window, planner, budget, loop ? guide : jobs::Guide(), [&](const TileTask& task) {
            for (std::size_t k = 0; k < task.count.size(); ++k) {
                const std::uint32_t end = task.first[k] + task.count[k];
                beyond_store += std::min(task.count[k], end - std::min(end, store.spp()));
            }
            return store.Answer(task);
        });
    const Film& film = *sampled.film;
    const denoise::Frame frame = denoise::FrameFromFilm(film);
    const auto pixels = static_cast<double>(window.area());
    double plan_seconds = 0;
    for (const auto& pass : sampled.info.passes) {
        plan_seconds += pass.plan_seconds;
    }
    Json line{{"scene", options.name},
              {"seed", seed},
              {"spp", spp},
              {"sampler", sampler},
              {"filter", filter},
              {"samples", film.TotalSamples() / pixels},
              {"beyond_store", static_cast<double>(beyond_store) / pixels},
              {"passes", sampled.info.passes.size()},
              {"plan_seconds", plan_seconds},
              {"guide_seconds", guide_seconds},
              {"sample_seconds", store.render_seconds() / pixels / store.spp()},
              {"pixels", window.area()}};
    Put("noisy", Compare(truth, [&](std::size_t i, int c) { return film.Mean(i)[c]; }), &line);
    line["est_film"] = film.EstimateRelMSE();
    if (filter != "none") {
        const auto start = std::chrono::steady_clock::now();
        const denoise::Result result = denoise::RunDenoiser(*denoiser, frame, never);
        line["filter_seconds"] = Since(start);
        const auto put_estimate = [&](const char* name, const denoise::ErrorEstimate& e) {
            line[name] = {{"relmse", e.relmse}, {"low", e.low}, {"high", e.high}};
        };
        put_estimate("est_noisy", denoise::EstimateNoisy(frame));
        if (const auto e = denoise::EstimateFiltered(*denoiser, frame, result, never)) {
            put_estimate("est_filtered", *e);
        }
        Put("filtered", Compare(truth, [&](std::size_t i, int c) { return result.color[c][i]; }),
            &line);
        const auto halves = denoise::FilterHalves(*denoiser, frame, never);
        Put("halves",
            Compare(truth,
                    [&](std::size_t i, int c) {
                        const auto k = static_cast<std::size_t>(c);
                        return 0.5 * (halves.color[0][k][i] + halves.color[1][k][i]);
                    }),
            &line);
    }
    fmt::print("{}\n", line.dump());
    std::fflush(stdout);
}

// A job with no budget but a target, in RelMSE of the filtered image: where it stopped, and what it
// reached.
void RunTarget(const Options& options, const SampleStore& store, const Truth& truth, int seed,
               double target, const std::string& sampler, const std::string& filter) {
    const TileRect& window = store.window();
    const auto pixels = static_cast<double>(window.area());
    jobs::JobSetup setup;
    setup.planner = jobs::MakePlanner(sampler);
    setup.budgets.target = target;
    setup.budgets.samples = std::uint64_t{store.spp() / 2} * window.area();
    setup.guide = GuideOf(*setup.planner, filter);
    setup.estimators.filtered = filter != "none";
    Json estimates = Json::array();
    setup.estimators.error = [&](const Film& film) {
        const double error = server::EstimateImageError(film, filter);
        const denoise::Result result = denoise::RunDenoiser(
            *denoise::MakeDenoiser(filter), denoise::FrameFromFilm(film), CancelToken());
        const Score score =
            Compare(truth, [&](std::size_t i, int c) { return result.color[c][i]; });
        estimates.push_back({film.TotalSamples() / pixels, error, score.relmse});
        return error;
    };
    const test::Sampled sampled = test::RunJob(
        window, std::move(setup), [&](const TileTask& task) { return store.Answer(task); });
    const denoise::Result result = denoise::RunDenoiser(
        *denoise::MakeDenoiser(filter), denoise::FrameFromFilm(*sampled.film), CancelToken());
    const Score score = Compare(truth, [&](std::size_t i, int c) { return result.color[c][i]; });
    fmt::print("{}\n", Json{{"scene", options.name},
                            {"seed", seed},
                            {"target", target},
                            {"sampler", sampler},
                            {"filter", filter},
                            {"samples", sampled.film->TotalSamples() / pixels},
                            {"passes", sampled.info.passes.size()},
                            {"estimates", estimates},
                            {"relmse", score.relmse}}
                           .dump());
    std::fflush(stdout);
}

void Run(const Options& options) {
    SetThreadCount(options.threads);
    RenderSettings settings =
        ViewSettings(options.size, options.look_from, options.look_at, options.fov);
    settings.environment_scale = options.environment_scale;
    // What is stored is asked for first: the scene is loaded only if something lacks.
    std::shared_ptr<const render::BuiltScene> built;
    int depth = options.depth;
    std::vector<SampleStore> stores(static_cast<std::size_t>(options.seeds));
    for (int seed = 0; seed < options.seeds; ++seed) {
        const auto file =
            std::filesystem::path(options.store) /
            fmt::format("{}-{}-{}-{}.samples", options.name, options.size, options.stored, seed);
        SampleStore& store = stores[static_cast<std::size_t>(seed)];
        if (store.Load(file, settings.Window(), options.stored)) {
            continue;
        }
        if (!built) {
            const SceneAndEnvironment files(options.scene, options.environment);
            LoadOptions load;
            load.environment = files.environment_name();
            load.environment_scale = options.environment_scale;
            load.time = options.time;
            load.shutter = options.shutter;
            Scene scene =
                LoadScene(files, std::filesystem::path(options.scene).filename().string(), load);
            depth = depth > 0 ? depth : scene.hints.max_depth > 0 ? scene.hints.max_depth : 8;
            built = std::make_shared<render::BuiltScene>(std::move(scene));
        }
        settings.max_depth = depth;
        settings.seed = static_cast<std::uint32_t>(seed);
        store = SampleStore::Render(render::Renderer(built, settings), settings.Window(),
                                    options.stored, options.threads);
        std::filesystem::create_directories(options.store);
        store.Save(file);
    }
    for (int seed = 0; seed < options.seeds; ++seed) {
        const Truth truth = FindTruth(stores, static_cast<std::size_t>(seed));
        if (seed == 0) {
            double floor = 0;
            for (std::size_t i = 0; i < truth.mean.size(); ++i) {
                for (int c = 0; c < 3; ++c) {
                    floor += truth.floor[i][c] / (truth.mean[i][c] * truth.mean[i][c] + 0.001) /
                             (3.0 * static_cast<double>(truth.mean.size()));
                }
            }
            fmt::print("{}\n", Json{{"scene", options.name}, {"floor", floor}}.dump());
        }
        for (const double target : options.targets) {
            for (const auto& filter : options.filters) {
                for (const auto& sampler : options.samplers) {
                    RunTarget(options, stores[static_cast<std::size_t>(seed)], truth, seed, target,
                              sampler, filter);
                }
            }
        }
        if (!options.targets.empty()) {
            continue;
        }
        for (const int spp : options.spp) {
            for (const auto& filter : options.filters) {
                for (const auto& sampler : options.samplers) {
                    RunOne(options, stores[static_cast<std::size_t>(seed)], truth, seed, spp,
                           sampler, filter);
                }
            }
        }
    }
}

int Main(int argc, char** argv) {
    Options options;
    CLI::App app("Samplers compared at equal numbers of samples.");
    app.add_option("SCENE", options.scene)->required();
    app.add_option("--name", options.name)->required();
    app.add_option("--store", options.store, "folder of the samples")->required();
    app.add_option("--environment", options.environment);
    app.add_option("--environment-scale", options.environment_scale);
    app.add_option("--time", options.time);
    app.add_option("--shutter", options.shutter);
    app.add_option("--size", options.size);
    app.add_option("--look-from", options.look_from)->delimiter(',');
    app.add_option("--look-at", options.look_at)->delimiter(',');
    app.add_option("--fov", options.fov);
    app.add_option("--max-depth", options.depth);
    app.add_option("--threads", options.threads);
    app.add_option("--seeds", options.seeds, "at least 3");
    app.add_option("--stored", options.stored, "samples a pixel that are rendered");
    app.add_option("--spp", options.spp)->delimiter(',');
    app.add_option("--target", options.targets, "instead of --spp")->delimiter(',');
    app.add_option("--sampler", options.samplers);
    app.add_option("--filter", options.filters);
    CLI11_PARSE(app, argc, argv);
    try {
        Run(options);
    } catch (const std::exception& error) {
        std::fprintf(stderr, "relume-sampling-study: %s\n", error.what());
        return 1;
    }
    return 0;
}

}  // namespace
}  // namespace relume::bench

int main(int argc, char** argv) { return relume::bench::Main(argc, argv); }
