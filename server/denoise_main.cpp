// relume-denoise: filters one EXR file, ours or another renderer's. `relume denoise` runs it.
#include <fmt/format.h>

#include <CLI/CLI.hpp>
#include <algorithm>
#include <csignal>
#include <cstdio>
#include <string>
#include <vector>

#include "core/base/error.h"
#include "core/base/parallel.h"
#include "core/image/exr.h"
#include "server/denoise/channel_names.h"
#include "server/denoise/denoiser.h"
#include "server/denoise/filter_frame.h"
#include "server/denoise/frame.h"
#include "server/denoise/output_image.h"

namespace {

struct Options {
    std::string input, output, filter = "auto", layer;
    float spp = 0;
    int threads = 0;
    bool all_layers = false, describe = false;
};

// Exit codes, those of relume (docs/commands.md).
constexpr int kExitUsage = 2, kExitInput = 3, kExitOutput = 6;

// Says on stderr what was missing in the file. `exit_code` is what a failure from here on means.
void Denoise(const Options& options, int* exit_code) {
    *exit_code = kExitUsage;
    (void)relume::denoise::MakeDenoiser(options.filter);  // says what is wrong with it
    *exit_code = kExitInput;
    relume::Image image = relume::ReadExr(options.input);
    std::vector<std::string> notes;
    try {
        if (!options.layer.empty()) {
            image = relume::denoise::SelectLayer(image, options.layer);
        }
        if (options.spp > 0 &&
            !relume::denoise::FindChannels(image, relume::denoise::Quantity::kCount)) {
            std::ranges::fill(image.Plane(image.Add("samples.Y")), options.spp);
        }
        const auto frame = relume::denoise::FrameFromImage(image, &notes);
        for (const std::string& note : notes) {
            fmt::print(stderr, "{}: {}\n", options.input, note);
        }
        const auto made = relume::denoise::FilterFrame(options.filter, frame, {});
        if (made.choice) {
            fmt::print(stderr, "{}: filter {}: {}{}\n", options.input, made.filter,
                       made.choice->reason,
                       made.choice->dropped.empty()
                           ? ""
                           : fmt::format("; of no use: {}", made.choice->dropped));
        }
        const auto* error = made.error ? &*made.error : nullptr;
        relume::Image out =
            relume::denoise::AssembleLayers(frame, made.result, error, options.all_layers);
        out.SetWindow(image.x0(), image.y0(), image.display_width(), image.display_height());
        if (image.Has("A")) {
            std::ranges::copy(image.Plane("A"), out.Plane("A").begin());
        }
        out.metadata() = image.metadata();
        out.metadata()["relume.filter"] = made.filter;
        relume::denoise::WriteClaim("relume.filtered_relmse", error, &out.metadata());
        *exit_code = kExitOutput;
        relume::WriteExr(options.output, out);
    } catch (const relume::Error& error) {
        // What is said of the picture does not know the file; what is said of a file names it.
        const std::string what = error.what();
        if (what.find(options.input) == std::string::npos &&
            what.find(options.output) == std::string::npos) {
            throw relume::Error(error.code(), options.input + ": " + what);
        }
        throw;
    }
}

}  // namespace

int main(int argc, char** argv) {
    Options options;
    CLI::App app{"Filters the noise out of an EXR file, ours or another renderer's."};
    auto* input = app.add_option("input", options.input, "EXR to read");
    auto* output = app.add_option("-o,--output", options.output, "EXR to write");
    app.add_option("--filter", options.filter, "name:key=value,...; see --describe")
        ->capture_default_str();
    app.add_option("--layer", options.layer, "read the channels below this layer of the file");
    app.add_option("--spp", options.spp,
                   "samples a pixel, where the file has no samples.Y; 0 = not known")
        ->check(CLI::Range(0.0, 1e9));
    app.add_option("--layers", options.all_layers, "basic, or all: also halves and variances")
        ->transform(
            CLI::CheckedTransformer(std::map<std::string, bool>{{"basic", false}, {"all", true}}));
    app.add_option("--threads", options.threads, "0 = one a core")->check(CLI::Range(0, 1024));
    app.add_flag("--describe", options.describe, "list the filters and their parameters");
    try {
        app.parse(argc, argv);
        if (!options.describe && (input->empty() || output->empty())) {
            throw CLI::RequiredError("input and --output");
        }
    } catch (const CLI::ParseError& error) {
        return app.exit(error) == 0 ? 0 : kExitUsage;
    }
    if (options.describe) {
        fmt::print("{}", relume::denoise::DescribeDenoisers());
        return 0;
    }
    // A file that may not grow is an error of a write, not an end.
    std::signal(SIGXFSZ, SIG_IGN);
    std::signal(SIGPIPE, SIG_IGN);
    relume::SetThreadCount(options.threads);
    int exit_code = 1;
    try {
        Denoise(options, &exit_code);
    } catch (const std::exception& error) {
        fmt::print(stderr, "relume-denoise: {}\n", error.what());
        return exit_code;
    }
    return 0;
}
