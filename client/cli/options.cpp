#include "client/cli/options.h"

#include <fmt/format.h>

#include <cstdlib>
#include <set>

#include "core/base/error.h"
#include "proto/codec/budgets.h"

namespace relume::client {
namespace {

std::string GivenOr(const std::string& given, const char* variable) {
    const char* environment = std::getenv(variable);
    return !given.empty() ? given : environment != nullptr ? environment : "";
}

}  // namespace

CLI::Validator Between(int low, int high) {
    // The help of the option tells the range in its own words.
    return CLI::Range(low, high).description("");
}

void AddJobOptions(CLI::App* app, JobOptions* options) {
    app->add_option("SCENE", options->scene, "scene file (.gltf, .glb, .pbrt, .obj)")
        ->required()
        ->type_name("FILE");
    app->add_option("--name", options->name, "what people call the job")->type_name("TEXT");
    app->add_option_function<std::string>(
           "--size", [options](const std::string& text) { options->size = ParseSize(text); },
           "size of the full image [the scene's, else 720 lines in the camera's shape, else "
           "1280x720]")
        ->type_name("WxH");
    app->add_option_function<std::string>(
           "--crop", [options](const std::string& text) { options->crop = ParseCrop(text); },
           "render these pixels alone: X0 <= x < X1, Y0 <= y < Y1, y down")
        ->type_name("X0,Y0,X1,Y1");
    AddBudgetOptions(app, &options->budgets);
    app->add_option("--sampler", options->sampler,
                    "where samples go; see `relume help samplers` [" + options->sampler + "]")
        ->type_name("NAME[:KEY=VALUE,...]");
    app->add_option("--filter", options->filter,
                    "what takes the noise out; see `relume help filters` [" + options->filter + "]")
        ->type_name("NAME[:KEY=VALUE,...]");
    app->add_option("--seed", options->seed, "another seed, other noise [0]")->type_name("N");
    app->add_option("--max-depth", options->max_depth,
                    "longest path in segments, 1 to 1024; 1: only what shines itself [the scene's, "
                    "else 8]")
        ->check(Between(1, 1024))
        ->type_name("N");
    app->add_option("--camera", options->camera, "a camera of the scene [the first]")
        ->type_name("NAME|INDEX");
    const auto add_vector = [app](const char* name, std::optional<Vec3f>* value, const char* help) {
        app->add_option_function<std::string>(
               name, [=](const std::string& text) { *value = ParseVector(name, text); }, help)
            ->type_name("X,Y,Z");
    };
    add_vector("--look-from", &options->look_from,
               "a camera there instead of the scene's; needs --look-at");
    add_vector("--look-at", &options->look_at, "what it has in the middle of the picture");
    add_vector("--look-up", &options->look_up, "what is up in the picture [0,1,0]");
    app->add_option("--fov", options->fov, "its full vertical angle in degrees, 1 to 175 [40]")
        ->check(CLI::Range(1.0, 175.0).description(""))
        ->type_name("DEG");
    app->add_option("--lens-radius", options->lens_radius,
                    "of the aperture, scene units; 0: a pinhole [the camera's own]")
        ->check(CLI::NonNegativeNumber.description(""))
        ->type_name("R");
    app->add_option("--focus-distance", options->focus_distance,
                    "of the plane in focus, scene units [the camera's own]")
        ->check(CLI::PositiveNumber.description(""))
        ->type_name("D");
    AddTimeOptions(app, &options->time, &options->shutter);
    app->add_option("--environment", options->environment,
                    "latitude-longitude map (.hdr, .exr) that lights the scene")
        ->type_name("FILE");
    app->add_option("--environment-scale", options->environment_scale, "times its radiance [1]")
        ->check(CLI::NonNegativeNumber.description(""))
        ->type_name("X");
    app->add_flag("--strict", options->strict,
                  "an error if anything of the scene is not supported or was replaced");
    app->add_flag("--allow-black", options->allow_black, "render although nothing shines");
    app->add_flag(
        "--keep-samples", options->keep_samples,
        "the server keeps all samples, 112 bytes each, for a filter that needs them (rpf)");
    app->add_option("--tile-size", options->tile_size,
                    "side of the units of work in pixels, 8 to 64; no matter to the image [32]")
        ->check(Between(8, 64))
        ->type_name("N");
    AddPriorityOption(app, &options->priority);
    app->add_option("--owner", options->owner,
                    "whose share of a server's workers it takes, where certificates do not tell "
                    "[USER@HOST]")
        ->type_name("NAME");
    app->add_option("--layers", options->layers,
                    "basic, or all: also the two halves and the features' variances [basic]")
        ->check(CLI::IsMember({"basic", "all"}).description(""))
        ->type_name("SET");
}

CLI::Option* AddPriorityOption(CLI::App* app, int* priority) {
    return app
        ->add_option(
            "--priority", *priority,
            "-100 to 100: jobs of a higher one come first, those of one share the farm [0]")
        ->check(Between(-100, 100))
        ->type_name("N");
}

void AddBudgetOptions(CLI::App* app, BudgetOptions* options) {
    const auto add_number = [app](const char* name, double most, std::optional<double>* value,
                                  const char* help, const char* type) {
        app->add_option_function<std::string>(
               name, [=](const std::string& text) { *value = ParsePositive(name, most, text); },
               help)
            ->type_name(type);
    };
    const auto add_count = [app](const char* name, std::optional<std::uint32_t>* value,
                                 const char* help) {
        app->add_option_function<std::string>(
               name,
               [=](const std::string& text) { *value = ParseCount(name, codec::kMaxSpp, text); },
               help)
            ->type_name("N");
    };
    add_number("--spp", codec::kMaxSpp, &options->spp,
               "budget: mean samples a pixel [the scene's; else, without another budget, until all "
               "is converged with sampler adaptive, 32 with others]",
               "N");
    add_count("--min-spp", &options->min_spp,
              "every pixel gets as many in the first pass [the sampler's `pilot`]");
    add_count("--max-spp", &options->max_spp,
              "budget: no pixel gets more [16384; no limit with --spp or --time-limit]");
    add_number("--target", codec::kMaxTarget, &options->target,
               "budget: stop at this estimated RelMSE of the image", "E");
    add_number("--time-limit", codec::kMaxTimeLimit, &options->time_limit,
               "budget: seconds that the whole may take, from the start to the image", "S");
}

void AddTimeOptions(CLI::App* app, std::optional<float>* time, std::optional<float>* shutter) {
    app->add_option("--time", *time,
                    "when the shutter opens, seconds into the animation [the scene's own]")
        ->check(CLI::NonNegativeNumber.description(""))
        ->type_name("S");
    app->add_option("--shutter", *shutter,
                    "how long it is open, seconds: what moves is blurred [the scene's own]")
        ->check(CLI::NonNegativeNumber.description(""))
        ->type_name("S");
}

void AddOutputOptions(CLI::App* app, OutputOptions* options) {
    app->add_option("-o,--output", options->image, "the image with all its layers (.exr)")
        ->required()
        ->type_name("FILE");
    app->add_option("--png", options->png, "an sRGB view of it, too")->type_name("FILE");
    app->add_option("--report", options->report, "how it was rendered, as JSON")->type_name("FILE");
}

void CheckOutputs(const OutputOptions& options) {
    std::set<std::string> paths;
    for (const auto& path : {options.image, options.png, options.report}) {
        if (!path.empty() && !paths.insert(path).second) {
            ThrowInvalidArgument(path + ": two results can't go into one file; name another");
        }
    }
    CheckOutput(options.image);
    for (const auto& path : {options.png, options.report}) {
        if (!path.empty()) {
            CheckOutput(path);
        }
    }
}

void AddServerOption(CLI::App* app, ServerOptions* given) {
    app->add_option("--server", given->address, "address of the server [RELUME_SERVER]")
        ->type_name("HOST:PORT");
    app->add_option("--tls-ca", given->tls.ca,
                    "CA of the server's certificate (PEM): all is encrypted [RELUME_TLS_CA]")
        ->type_name("FILE");
    app->add_option("--tls-cert", given->tls.cert,
                    "our certificate (PEM), if the server asks for one [RELUME_TLS_CERT]")
        ->type_name("FILE");
    app->add_option("--tls-key", given->tls.key, "its private key (PEM) [RELUME_TLS_KEY]")
        ->type_name("FILE");
}

Endpoint FindServer(const ServerOptions& given) {
    Endpoint server;
    server.address = GivenOr(given.address, "RELUME_SERVER");
    if (server.address.empty()) {
        return server;
    }
    if (server.address.find(':') == std::string::npos) {
        ThrowInvalidArgument(fmt::format("server '{}': must be HOST:PORT, e.g. {}:7878",
                                         server.address, server.address));
    }
    server.tls = LoadClientTls({GivenOr(given.tls.cert, "RELUME_TLS_CERT"),
                                GivenOr(given.tls.key, "RELUME_TLS_KEY"),
                                GivenOr(given.tls.ca, "RELUME_TLS_CA")});
    return server;
}

Endpoint RequireServer(const ServerOptions& given) {
    Endpoint server = FindServer(given);
    if (server.address.empty()) {
        ThrowInvalidArgument(
            "which server? say --server HOST:PORT, or set RELUME_SERVER; `relume farm` starts one "
            "on this machine");
    }
    return server;
}

void AddQuietOption(CLI::App* app, TalkOptions* options) {
    app->add_flag("--quiet", options->quiet, "no progress and no notes");
}

void AddJsonOption(CLI::App* app, TalkOptions* options) {
    app->add_flag("--json", options->json, "results as JSON");
}

}  // namespace relume::client
