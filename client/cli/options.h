#pragma once

#include <CLI/CLI.hpp>
#include <cstdint>
#include <memory>
#include <optional>
#include <string>

#include "client/cli/option_values.h"
#include "client/lib/client.h"
#include "client/lib/output_file.h"

namespace relume::client {

// Where neither options nor the scene say a budget: by sampler.
inline constexpr double kDefaultSpp = 32;
inline constexpr double kDefaultTarget = 0.005;

// A whole number from `low` to `high`.
CLI::Validator Between(int low, int high);

// Groups of options that several commands share. The structs must outlive the parsing: commands
// keep them in a shared_ptr that their Runner holds.

// What ends the sampling, whatever is met first. All unset: the scene's spp, else the defaults.
struct BudgetOptions {
    std::optional<double> spp;  // mean samples a pixel
    std::optional<std::uint32_t> min_spp, max_spp;
    std::optional<double> target;      // RelMSE
    std::optional<double> time_limit;  // seconds of the whole command
};
void AddBudgetOptions(CLI::App* app, BudgetOptions* options);

// What a job is: everything of v1.JobSpec.
struct JobOptions {
    std::string scene;
    std::string name;
    std::optional<Size> size;  // unset: by the camera's shape
    TileRect crop;             // empty: the full frame
    BudgetOptions budgets;
    std::string sampler = "adaptive";  // the defaults that jobs.proto tells
    std::string filter = "auto";
    std::uint32_t seed = 0;
    std::optional<int> max_depth;  // unset: the scene's, else 8
    std::string camera;
    std::optional<Vec3f> look_from, look_at, look_up;
    std::optional<float> fov;  // degrees
    bool strict = false;
    std::optional<float> lens_radius, focus_distance;
    std::optional<float> time, shutter;
    std::string environment;
    float environment_scale = 1;
    bool allow_black = false;
    bool keep_samples = false;
    int tile_size = 32;
    std::string layers = "basic";
    int priority = 0;
    std::string owner;  // "": as UserAtHost
};
void AddJobOptions(CLI::App* app, JobOptions* options);
CLI::Option* AddPriorityOption(CLI::App* app, int* priority);
// --time and --shutter.
void AddTimeOptions(CLI::App* app, std::optional<float>* time, std::optional<float>* shutter);

// Where a job's result goes.
struct OutputOptions {
    std::string image, png, report;
};
void AddOutputOptions(CLI::App* app, OutputOptions* options);
// Throws OutputError before anything is rendered in vain.
void CheckOutputs(const OutputOptions& options);

// Which server is asked, and how we show who we are: --server, --tls-ca, --tls-cert and --tls-key,
// each where not given from RELUME_SERVER, RELUME_TLS_CA, ...
struct ServerOptions {
    std::string address;
    TlsFiles tls;
};
void AddServerOption(CLI::App* app, ServerOptions* given);
// The address is "" if neither says one. Throws kInvalidArgument for files that don't do.
Endpoint FindServer(const ServerOptions& given);
// Throws kInvalidArgument if neither does.
Endpoint RequireServer(const ServerOptions& given);

// How a command speaks.
struct TalkOptions {
    bool quiet = false;
    bool json = false;
};
void AddQuietOption(CLI::App* app, TalkOptions* options);
void AddJsonOption(CLI::App* app, TalkOptions* options);

}  // namespace relume::client
