// relume-farm-load: simulated workers for a server that has a job, and what they and the server
// did in a span of time, as JSON. bench/farm/run starts both; docs/bench.md tells how to read it.
#include <fmt/format.h>

#include <CLI/CLI.hpp>
#include <algorithm>
#include <cmath>
#include <cstdio>
#include <nlohmann/json.hpp>
#include <string>
#include <thread>
#include <vector>

#include "bench/farm/process_figures.h"
#include "bench/farm/simulated_farm.h"
#include "core/base/error.h"

namespace relume::bench {
namespace {

using Json = nlohmann::ordered_json;

constexpr double kPatienceSeconds = 30;  // for the first lease

struct Options {
    SimulatedFarmOptions farm;
    int server_pid = 0;
    double warm_up = 2, seconds = 10;
};

void Sleep(double seconds) { std::this_thread::sleep_for(std::chrono::duration<double>(seconds)); }

// Of sorted values, the one below which are `share` of them; 0 of none.
double Quantile(const std::vector<float>& sorted, double share) {
    if (sorted.empty()) {
        return 0;
    }
    const auto last = static_cast<double>(sorted.size() - 1);
    return sorted[static_cast<std::size_t>(std::lround(share * last))];
}

void Run(const Options& options) {
    SimulatedFarm farm(options.farm);
    Work work;
    for (double waited = 0; work.leases == 0; waited += 0.05) {
        if (waited > kPatienceSeconds || farm.ended() > 0) {
            throw Error(ErrorCode::kUnavailable,
                        fmt::format("no lease came from {}: is a job under way? {}",
                                    options.farm.server, farm.why()));
        }
        Sleep(0.05);
        work = farm.Take();
    }
    Sleep(options.warm_up);

    farm.Take();
    const auto start = Clock::now();
    const ProcessFigures before = FiguresOf(options.server_pid);
    Sleep(options.seconds);
    work = farm.Take();
    const ProcessFigures after = FiguresOf(options.server_pid);
    const double wall = std::chrono::duration<double>(Clock::now() - start).count();
    if (farm.ended() > 0) {
        throw Error(ErrorCode::kUnavailable,
                    fmt::format("{} streams ended: {}", farm.ended(), farm.why()));
    }

    std::sort(work.round_trips.begin(), work.round_trips.end());
    const double user = after.user - before.user, system = after.system - before.system;
    const Json json{{"workers", options.farm.workers},
                    {"samples_per_second_each", options.farm.samples_per_second},
                    {"noisy", options.farm.noisy},
                    {"wall_seconds", wall},
                    {"leases", work.leases},
                    {"records", work.records},
                    {"samples", work.samples},
                    {"bytes", work.bytes},
                    {"server_user_seconds", user},
                    {"server_system_seconds", system},
                    {"server_resident", after.resident},
                    {"server_peak", after.peak},
                    {"round_trips", work.round_trips.size()},
                    {"round_trip_median", Quantile(work.round_trips, 0.5)},
                    {"round_trip_p99", Quantile(work.round_trips, 0.99)},
                    {"round_trip_longest", Quantile(work.round_trips, 1)}};
    fmt::print("{}\n", json.dump(2));
}

}  // namespace
}  // namespace relume::bench

int main(int argc, char** argv) {
    relume::bench::Options options;
    CLI::App app{"Simulated workers, which answer leases of a server's jobs without tracing."};
    app.add_option("--server", options.farm.server, "HOST:PORT")->required();
    app.add_option("--server-pid", options.server_pid, "its process, on this machine")->required();
    app.add_option("--workers", options.farm.workers, "of one thread each")
        ->capture_default_str()
        ->check(CLI::Range(1, 10000));
    app.add_option("--rate", options.farm.samples_per_second,
                   "samples a second of each; 0: they answer at once")
        ->capture_default_str()
        ->check(CLI::Range(0.0, 1e9));
    app.add_option("--credits", options.farm.credits, "leases that each holds")
        ->capture_default_str()
        ->check(CLI::Range(1, 1000));
    app.add_option("--noisy", options.farm.noisy, "share of pixels whose feature moments are noisy")
        ->capture_default_str()
        ->check(CLI::Range(0.0, 1.0));
    app.add_option("--warm-up", options.warm_up, "seconds from the first lease on, not measured")
        ->capture_default_str()
        ->check(CLI::Range(0.0, 3600.0));
    app.add_option("--seconds", options.seconds, "measured")
        ->capture_default_str()
        ->check(CLI::Range(0.1, 3600.0));
    CLI11_PARSE(app, argc, argv);
    try {
        relume::bench::Run(options);
    } catch (const std::exception& error) {
        fmt::print(stderr, "relume-farm-load: {}\n", error.what());
        return 1;
    }
    return 0;
}
