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
#include <ctime>
#include <memory>
#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "bench/scene_source.h"
#include "bench/study_scene.h"
#include "bench/truth.h"
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
    StudyScene scene;
    std::vector<int> spp{16, 32, 64};
    std::vector<double> targets;
    std::vector<std::string> samplers{"uniform", "adaptive"}, filters{"none"};
};

double Since(std::chrono::steady_clock::time_point start) {
    return std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
}

void Put(const char* what, const Score& score, Json* line) {
    (*line)[what] = {{"mrse", score.mrse},
                     {"trimmed", score.trimmed},
                     {"relmse", score.relmse},
                     {"energy", score.energy}};
}

// Of the processor, all threads of this program together.
double ProcessSeconds() {
    timespec time{};
    clock_gettime(CLOCK_PROCESS_CPUTIME_ID, &time);
    return static_cast<double>(time.tv_sec) + 1e-9 * static_cast<double>(time.tv_nsec);
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
    std::string Save() const override { return {}; }
    void Restore(std::string_view) override {}
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
    const double cpu = ProcessSeconds();
    double answer_cpu = 0;
    const test::Sampled sampled = test::RunJob(
        window, planner, budget, loop ? guide : jobs::Guide(), [&](const TileTask& task) {
            for (std::size_t k = 0; k < task.count.size(); ++k) {
                const std::uint32_t end = task.first[k] + task.count[k];
                beyond_store += std::min(task.count[k], end - std::min(end, store.spp()));
            }
            const double before = ProcessSeconds();
            TileResult answer = store.Answer(task);
            answer_cpu += ProcessSeconds() - before;
            return answer;
        });
    const double plan_cpu = ProcessSeconds() - cpu - answer_cpu;
    const Film& film = *sampled.film;
    const denoise::Frame frame = denoise::FrameFromFilm(film);
    const auto pixels = static_cast<double>(window.area());
    double plan_seconds = 0;
    for (const auto& pass : sampled.info.passes) {
        plan_seconds += pass.plan_seconds;
    }
    Json line{{"scene", options.scene.name},
              {"seed", seed},
              {"spp", spp},
              {"sampler", sampler},
              {"filter", filter},
              {"samples", film.TotalSamples() / pixels},
              {"beyond_store", static_cast<double>(beyond_store) / pixels},
              {"passes", sampled.info.passes.size()},
              {"plan_seconds", plan_seconds},
              {"guide_seconds", guide_seconds},
              {"plan_cpu", plan_cpu},  // of plans, guides and merges
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
    const auto estimate = server::MakeErrorEstimator(filter).error;
    setup.estimators.error = [&](const Film& film) {
        const double error = estimate(film);
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
    fmt::print("{}\n", Json{{"scene", options.scene.name},
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
    SetThreadCount(options.scene.threads);
    const std::vector<SampleStore> stores = LoadSamples(options.scene);
    const std::vector<Truth> truths = FindTruths(stores, stores.size());
    for (int seed = 0; seed < options.scene.seeds; ++seed) {
        const Truth& truth = truths[static_cast<std::size_t>(seed)];
        if (seed == 0) {
            fmt::print("{}\n",
                       Json{{"scene", options.scene.name}, {"floor", truth.error.mrse}}.dump());
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
    AddSceneOptions(&app, &options.scene);
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
