// relume compare: how far images are from a reference (core/image/metrics.h defines the measures).
#include <fmt/format.h>

#include <cmath>
#include <cstdio>
#include <memory>
#include <nlohmann/json.hpp>

#include "client/cli/commands.h"
#include "client/cli/exit_codes.h"
#include "client/cli/options.h"
#include "client/cli/table.h"
#include "core/image/exr.h"
#include "core/image/metrics.h"

namespace relume::client {
namespace {

struct CompareOptions {
    std::string reference;
    std::vector<std::string> tests;
    std::string reference_layer, test_layer;
    TalkOptions talk;
};

// JSON has no infinity and no NaN: null.
nlohmann::ordered_json Number(double value) {
    return std::isfinite(value) ? nlohmann::ordered_json(value) : nlohmann::ordered_json(nullptr);
}

int RunCompare(const CompareOptions& options) {
    auto json = nlohmann::ordered_json::array();
    std::vector<std::vector<std::string>> rows{{"TEST", "MrSE", "MrSE trimmed", "RelMSE", "SSIM",
                                                "PSNR", "FLIP", "energy", "bad", "negative"}};
    WithExitCode(kExitInput, [&] {
        const Image reference = ReadExr(options.reference);
        for (const auto& test : options.tests) {
            const ImageError e = CompareImages(reference, ReadExr(test), options.reference_layer,
                                               options.test_layer);
            json.push_back({{"test", test},
                            {"reference", options.reference},
                            {"mrse", Number(e.mrse)},
                            {"mrse_trimmed", Number(e.mrse_trimmed)},
                            {"relmse", Number(e.relmse)},
                            {"ssim", Number(e.ssim)},
                            {"psnr", Number(e.psnr)},
                            {"flip", Number(e.flip)},
                            {"energy", Number(e.energy)},
                            {"bad", e.bad},
                            {"negative", e.negative}});
            rows.push_back({test, fmt::format("{:.4g}", e.mrse),
                            fmt::format("{:.4g}", e.mrse_trimmed), fmt::format("{:.4g}", e.relmse),
                            fmt::format("{:.5f}", e.ssim), fmt::format("{:.2f}", e.psnr),
                            fmt::format("{:.4f}", e.flip), fmt::format("{:.4f}", e.energy),
                            std::to_string(e.bad), std::to_string(e.negative)});
        }
    });
    if (options.talk.json) {
        fmt::print("{}\n", json.dump(2));
    } else {
        fmt::print("{}", FormatTable(rows));
    }
    return kExitDone;
}

}  // namespace

Runner AddCompare(CLI::App* app) {
    const auto options = std::make_shared<CompareOptions>();
    app->add_option("REFERENCE", options->reference, "image to compare with (.exr)")
        ->required()
        ->type_name("FILE");
    app->add_option("TEST", options->tests, "images to compare (.exr)")
        ->required()
        ->type_name("FILE");
    app->add_option("--layer", options->test_layer, "of the tests, e.g. noisy [the image itself]")
        ->type_name("NAME");
    app->add_option("--reference-layer", options->reference_layer,
                    "of the reference [the image itself]")
        ->type_name("NAME");
    AddJsonOption(app, &options->talk);
    return [options](Interrupts*) { return RunCompare(*options); };
}

}  // namespace relume::client
