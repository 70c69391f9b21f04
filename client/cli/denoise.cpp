// relume denoise: filters an EXR that has the channels. relume-denoise, which has the filters, does
// it.
#include <memory>

#include "client/cli/commands.h"
#include "client/cli/exit_codes.h"
#include "client/cli/replace_process.h"
#include "client/lib/output_file.h"

namespace relume::client {
namespace {

struct DenoiseOptions {
    std::string input, output, filter = "bilateral";
    int threads = 0;
};

}  // namespace

Runner AddDenoise(CLI::App* app) {
    const auto options = std::make_shared<DenoiseOptions>();
    app->add_option("IN", options->input, "image to filter (.exr), with noisy and feature layers")
        ->required();
    app->add_option("-o,--output", options->output, "filtered image (.exr)")
        ->required()
        ->type_name("FILE");
    app->add_option("--filter", options->filter, "see `relume help filters` [bilateral]");
    app->add_option("--threads", options->threads, "0: one a core [0]")->check(CLI::Range(0, 1024));
    return [options](Interrupts*) -> int {
        CheckOutput(options->output);
        ReplaceProcess("relume-denoise",
                       {"-o", options->output, "--filter", options->filter, "--threads",
                        std::to_string(options->threads), "--", options->input});
    };
}

}  // namespace relume::client
