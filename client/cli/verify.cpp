// relume verify: whether an image is as close to the truth as it says. A few of its pixels, chosen
// at random, are rendered anew by another seed (sampler "probe"); client/lib/verify.h compares.
#include <fmt/format.h>

#include <algorithm>
#include <chrono>
#include <cstdio>
#include <memory>
#include <nlohmann/json.hpp>

#include "client/cli/commands.h"
#include "client/cli/exit_codes.h"
#include "client/cli/job_result.h"
#include "client/cli/options.h"
#include "client/cli/progress_meter.h"
#include "client/cli/run_job.h"
#include "client/cli/table.h"
#include "client/lib/image_origin.h"
#include "client/lib/verify.h"
#include "core/base/error.h"
#include "core/base/files.h"
#include "core/image/exr.h"
#include "proto/codec/codec.h"
#include "proto/codec/protocol.h"

namespace relume::client {
namespace {

using Json = nlohmann::ordered_json;

// A pixel with more than this of the measured error makes the interval doubtful.
constexpr double kFireflyShare = 0.3;

struct VerifyOptions {
    std::string image, scene, environment;
    int pixels = 1024, spp = 256;
    std::optional<std::uint32_t> seed;
    PlaceOptions place;
    TalkOptions talk;
};

// One of the images that the file holds, and what is said of it.
struct Check {
    std::string of;
    std::optional<Claim> claim;
    MeasuredError measured;

    bool holds() const { return !claim || Agree(*claim, measured); }
    std::string verdict() const {
        return !claim ? "no claim" : holds() ? "holds" : "does not hold";
    }
};

std::uint32_t AnotherSeed(std::uint32_t seed) { return (seed ^ 0x5bd1e995u) * 0x9e3779b1u + 1; }

PreparedJob PrepareProbe(const VerifyOptions& options, const ImageOrigin& origin,
                         std::uint32_t seed, std::size_t pixels) {
    PreparedJob job;
    job.scene =
        CollectScene(options.scene, FindEnvironment(origin, options.scene, options.environment));
    const std::string digest = ManifestDigest(job.scene.manifest);
    if (digest != origin.scene_sha256) {
        ThrowInvalidArgument(fmt::format(
            "{} is not the scene of {}: its files have the digest {}, the image's had {}; name the "
            "scene that it was rendered from, as it was then",
            options.scene, options.image, digest, origin.scene_sha256));
    }
    RenderSettings settings = origin.settings;
    settings.seed = seed;
    settings.environment = job.scene.environment;
    *job.spec.mutable_scene() = codec::ToProto(job.scene.manifest);
    *job.spec.mutable_settings() = codec::ToProto(settings);
    job.spec.set_sampler(fmt::format("probe:pixels={},spp={},salt={}", options.pixels, options.spp,
                                     seed % 1'000'000));
    job.spec.set_filter("none");
    job.spec.set_all_layers(true);  // the halves
    job.spec.set_spp(static_cast<double>(pixels) * options.spp /
                     static_cast<double>(settings.Window().area()));
    job.spec.set_display_name("verify " + options.image);
    return job;
}

// The claims that are there; of the filtered image also what is measured, if it is another one.
std::vector<Check> MakeChecks(const Image& image, const ImageOrigin& origin, const Image& probe) {
    std::vector<Check> checks{
        {"unfiltered", ReadClaim(image, "relume.relmse"), MeasureError(image, "noisy", probe)}};
    const auto filtered = ReadClaim(image, "relume.filtered_relmse");
    if (filtered || origin.filter != "none") {
        checks.push_back({"filtered", filtered, MeasureError(image, "", probe)});
    }
    return checks;
}

std::vector<std::string> Warnings(const std::vector<Check>& checks) {
    std::vector<std::string> warnings;
    for (const auto& check : checks) {
        const MeasuredError& m = check.measured;
        if (m.worst_share > kFireflyShare) {
            warnings.push_back(fmt::format(
                "{}: pixel {},{} makes {:.0f} % of the measured error: fireflies rule it, and the "
                "interval may be too narrow; try more --pixels",
                check.of, m.worst_x, m.worst_y, 100 * m.worst_share));
        }
    }
    return warnings;
}

Json CheckJson(const Check& check) {
    const MeasuredError& m = check.measured;
    Json json{{"of", check.of}, {"claimed", nullptr}, {"claimed_interval", nullptr}};
    if (check.claim) {
        json["claimed"] = check.claim->relmse;
        json["claimed_interval"] = {check.claim->low, check.claim->high};
    }
    json["measured"] = m.relmse;
    json["measured_interval"] = {m.low, m.high};
    json["worst_share"] = m.worst_share;
    json["worst_pixel"] = {m.worst_x, m.worst_y};
    json["verdict"] = check.verdict();
    return json;
}

void PrintTable(const std::vector<Check>& checks) {
    std::vector<std::vector<std::string>> rows{
        {"RelMSE", "claimed", "from", "to", "measured", "from", "to", "worst pixel", "verdict"}};
    const auto number = [](double value) { return fmt::format("{:.4g}", value); };
    for (const auto& check : checks) {
        std::vector<std::string> row{check.of};
        if (check.claim) {
            row.insert(row.end(), {number(check.claim->relmse), number(check.claim->low),
                                   number(check.claim->high)});
        } else {
            row.insert(row.end(), {"-", "-", "-"});
        }
        const MeasuredError& m = check.measured;
        row.insert(row.end(), {number(m.relmse), number(m.low), number(m.high),
                               fmt::format("{:.1f} %", 100 * m.worst_share), check.verdict()});
        rows.push_back(row);
    }
    fmt::print("{}", FormatTable(rows));
}

// The image and its origin; errors name the file.
std::pair<Image, ImageOrigin> ReadClaimed(const std::string& path) {
    Image image = ReadExr(path);
    try {
        ImageOrigin origin = ReadOrigin(image);
        if (!ReadClaim(image, "relume.relmse") && !ReadClaim(image, "relume.filtered_relmse")) {
            ThrowInvalidArgument("claims no error: it has no metadata relume.relmse");
        }
        return {std::move(image), std::move(origin)};
    } catch (const Error& error) {
        throw Error(error.code(), path + ": " + error.what());
    }
}

int RunVerify(const VerifyOptions& options, Interrupts* interrupts) {
    const auto start = std::chrono::steady_clock::now();
    ProgressMeter meter(ChooseProgressStyle(options.talk.quiet, stderr), stderr);
    const auto [image, origin] =
        WithExitCode(kExitInput, [&] { return ReadClaimed(options.image); });
    const std::uint32_t seed = options.seed.value_or(AnotherSeed(origin.settings.seed));
    if (seed == origin.settings.seed) {
        ThrowInvalidArgument(fmt::format(
            "--seed {} is the image's own: its samples can't tell how far off they are; choose "
            "another",
            seed));
    }
    if (origin.build != kBuild) {
        meter.Note(
            fmt::format("note: {} was rendered by {}, this is {}: a difference may come "
                        "from that",
                        options.image, origin.build, kBuild));
    }
    const std::size_t pixels =
        std::min(image.pixel_count(), static_cast<std::size_t>(options.pixels));
    const PreparedJob prepared =
        WithExitCode(kExitInput, [&] { return PrepareProbe(options, origin, seed, pixels); });

    std::vector<Check> checks;
    ReportFacts facts;
    RunJob(
        prepared, options.place, interrupts, &meter, &facts, 0,
        [&](v1::Job job) {
            // Of an image that is empty but for the probed pixels.
            job.clear_relmse();
            job.clear_image_relmse();
            job.clear_forecast();
            meter.Update(job);
        },
        [&](Client* client, const v1::Job& job) {
            const TemporaryFolder folder;
            OutputFile file((folder.path() / "probe.exr").string());
            client->Fetch(job.name(), &file);
            checks = WithExitCode(
                kExitInput, [&] { return MakeChecks(image, origin, ReadExr(file.temporary())); });
        });

    const bool holds = std::ranges::all_of(checks, &Check::holds);
    const double seconds =
        std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
    const auto warnings = Warnings(checks);
    if (options.talk.json) {
        Json json{{"image", options.image},
                  {"scene", options.scene},
                  {"pixels", checks[0].measured.pixels},
                  {"spp", options.spp},
                  {"seed", seed},
                  {"seconds", seconds},
                  {"holds", holds},
                  {"checks", Json::array()},
                  {"warnings", warnings}};
        for (const auto& check : checks) {
            json["checks"].push_back(CheckJson(check));
        }
        fmt::print("{}\n", json.dump(2));
    } else {
        fmt::print("{}: {} of {} pixels, {} samples each, seed {}, {:.1f} s\n", options.image,
                   checks[0].measured.pixels, image.pixel_count(), options.spp, seed, seconds);
        PrintTable(checks);
        for (const auto& warning : warnings) {
            fmt::print("warning: {}\n", warning);
        }
    }
    return holds ? kExitDone : kExitClaim;
}

}  // namespace

Runner AddVerify(CLI::App* app) {
    const auto options = std::make_shared<VerifyOptions>();
    app->add_option("IMAGE", options->image, "image that relume rendered (.exr)")
        ->required()
        ->type_name("FILE");
    app->add_option("SCENE", options->scene, "the scene that it was rendered from")
        ->required()
        ->type_name("FILE");
    app->add_option("--environment", options->environment,
                    "the map that lit it, if that is not in the scene's folder")
        ->type_name("FILE");
    app->add_option("--pixels", options->pixels,
                    "how many pixels are rendered anew, 2 to 1000000 [1024]")
        ->check(Between(2, 1'000'000))
        ->type_name("N");
    app->add_option("--spp", options->spp, "samples of each; even, 2 to 1000000 [256]")
        ->check(Between(2, 1'000'000))
        ->type_name("N");
    app->add_option("--seed", options->seed,
                    "of their choice and their samples [made from the image's]")
        ->type_name("N");
    const auto settle = AddPlaceOptions(app, &options->place);
    AddQuietOption(app, &options->talk);
    AddJsonOption(app, &options->talk);
    return [=](Interrupts* interrupts) {
        settle();
        if (options->spp % 2 != 0) {
            ThrowInvalidArgument(fmt::format(
                "--spp {}: must be even, so that both halves have as many", options->spp));
        }
        return RunVerify(*options, interrupts);
    };
}

}  // namespace relume::client
