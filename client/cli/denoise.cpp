// relume denoise: filters an EXR that has the channels. relume-denoise, which has the filters, does
// it.
#include <memory>
#include <string>
#include <vector>

#include "client/cli/commands.h"
#include "client/cli/options.h"
#include "client/cli/replace_process.h"
#include "client/lib/output_file.h"
#include "proto/codec/budgets.h"

namespace relume::client {
namespace {

struct DenoiseOptions {
    std::string input, output, filter = "auto", layer, layers = "basic";
    double spp = 0;
    int threads = 0;
};

std::vector<std::string> Arguments(const DenoiseOptions& options) {
    std::vector<std::string> arguments{
        "-o",       options.output, "--filter",  options.filter,
        "--layers", options.layers, "--threads", std::to_string(options.threads)};
    if (!options.layer.empty()) {
        arguments.insert(arguments.end(), {"--layer", options.layer});
    }
    if (options.spp > 0) {
        arguments.insert(arguments.end(), {"--spp", std::to_string(options.spp)});
    }
    arguments.insert(arguments.end(), {"--", options.input});
    return arguments;
}

}  // namespace

Runner AddDenoise(CLI::App* app) {
    const auto options = std::make_shared<DenoiseOptions>();
    app->add_option("IN", options->input, "image to filter (.exr), of any renderer")
        ->required()
        ->type_name("FILE");
    app->add_option("-o,--output", options->output, "filtered image (.exr)")
        ->required()
        ->type_name("FILE");
    app->add_option("--filter", options->filter,
                    "see `relume help filters` [" + options->filter + "]")
        ->type_name("NAME[:KEY=VALUE,...]");
    app->add_option("--layer", options->layer, "read the channels below this layer [the image's]")
        ->type_name("NAME");
    app->add_option_function<std::string>(
           "--spp",
           [options](const std::string& text) {
               options->spp = ParsePositive("--spp", codec::kMaxSpp, text);
           },
           "samples a pixel, for a file without samples.Y [not known]")
        ->type_name("N");
    app->add_option("--layers", options->layers,
                    "basic, or all: also the two halves and the features' variances [basic]")
        ->check(CLI::IsMember({"basic", "all"}).description(""))
        ->type_name("SET");
    app->add_option("--threads", options->threads, "up to 1024; 0: one a core [0]")
        ->check(Between(0, 1024))
        ->type_name("N");
    return [options](Interrupts*) -> int {
        CheckOutput(options->output);
        ReplaceProcess("relume-denoise", Arguments(*options));
    };
}

}  // namespace relume::client
