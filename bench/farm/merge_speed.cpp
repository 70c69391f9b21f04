// relume-merge-speed: how many pixel records a core reads from messages, checks and merges into a
// film, without a network. docs/bench.md tells how to read it.
#include <fmt/format.h>
#include <malloc.h>
#include <time.h>

#include <CLI/CLI.hpp>
#include <algorithm>
#include <cstdio>
#include <nlohmann/json.hpp>
#include <string>
#include <utility>
#include <vector>

#include "bench/farm/answers.h"
#include "core/film/film.h"
#include "proto/codec/codec.h"
#include "proto/codec/digests.h"
#include "relume/v1/work.pb.h"
#include "server/jobs/check_result.h"

namespace relume::bench {
namespace {

using Json = nlohmann::ordered_json;

struct Options {
    int side = 1024, tile = 32, repeats = 9;
    std::uint32_t spp = 64;
    double noisy = 1;
    bool json = false;
};

// CPU seconds of this thread so far: nobody else's work counts.
double CpuSeconds() {
    timespec t{};
    clock_gettime(CLOCK_THREAD_CPUTIME_ID, &t);
    return static_cast<double>(t.tv_sec) + 1e-9 * static_cast<double>(t.tv_nsec);
}

struct Costs {
    double parse = 0, decode = 0, digest = 0, check = 0, merge = 0;
    double total() const { return parse + decode + digest + check + merge; }
};

// One pass over the film, a message a tile. Reading the clock costs a nanosecond a record.
Costs MergePass(const std::vector<TileTask>& tasks, const std::string& bytes, Film* film) {
    Costs costs;
    for (const TileTask& task : tasks) {
        double now = CpuSeconds();
        const auto lap = [&now] {
            const double last = std::exchange(now, CpuSeconds());
            return now - last;
        };
        v1::WorkRequest message;
        message.ParseFromString(bytes);
        costs.parse += lap();
        const TileResult result = codec::DecodePlanes(task, message.result().planes());
        costs.decode += lap();
        codec::CheckChecksum(result, message.result());
        costs.digest += lap();
        jobs::CheckResult(task, result);
        costs.check += lap();
        film->Merge(result);
        costs.merge += lap();
    }
    return costs;
}

void Run(const Options& options) {
    // As relume-server does.
    mallopt(M_MMAP_THRESHOLD, 32 << 20);
    mallopt(M_TRIM_THRESHOLD, 128 << 20);
    const int side = std::max(options.side / options.tile, 1) * options.tile;
    Film film({0, 0, side, side}, side, side);
    std::vector<TileTask> tasks;
    for (const TileRect& rect : CutIntoTiles(film.window(), options.tile)) {
        TileTask& task = tasks.emplace_back();
        task.rect = rect;
        task.first.assign(rect.area(), 0);
        task.count.assign(rect.area(), options.spp);
    }
    v1::WorkRequest message;
    const TileResult made = MakeUp(tasks.front(), options.noisy);
    message.mutable_result()->set_planes(codec::EncodePlanes(made));
    message.mutable_result()->set_checksum(codec::ResultChecksum(made));
    const std::string bytes = message.SerializeAsString();

    std::vector<Costs> passes;
    for (int i = 0; i < options.repeats; ++i) {
        passes.push_back(MergePass(tasks, bytes, &film));
    }
    std::sort(passes.begin(), passes.end(),
              [](const Costs& a, const Costs& b) { return a.total() < b.total(); });
    const Costs& costs = passes[passes.size() / 2];
    const auto records = static_cast<double>(film.pixel_count());
    const auto ns = [&](double seconds) { return seconds / records * 1e9; };
    const double bytes_a_record =
        static_cast<double>(bytes.size()) / static_cast<double>(tasks.front().rect.area());
    if (options.json) {
        const Json json{
            {"noisy", options.noisy},        {"bytes_a_record", bytes_a_record},
            {"parse_ns", ns(costs.parse)},   {"decode_ns", ns(costs.decode)},
            {"digest_ns", ns(costs.digest)}, {"check_ns", ns(costs.check)},
            {"merge_ns", ns(costs.merge)},   {"records_per_second", records / costs.total()}};
        fmt::print("{}\n", json.dump(2));
        return;
    }
    fmt::print(
        "{:.1f} bytes a record; ns a record: parse {:.1f}, decode {:.1f}, digest {:.1f}, check "
        "{:.1f}, merge {:.1f}; together {:.2f} M records/s\n",
        bytes_a_record, ns(costs.parse), ns(costs.decode), ns(costs.digest), ns(costs.check),
        ns(costs.merge), records / costs.total() / 1e6);
}

}  // namespace
}  // namespace relume::bench

int main(int argc, char** argv) {
    relume::bench::Options options;
    CLI::App app{"Reads results from messages, checks and merges them: what a core does of it."};
    app.add_option("--side", options.side, "of the film, pixels")
        ->capture_default_str()
        ->check(CLI::Range(64, 8192));
    app.add_option("--tile", options.tile, "side of a tile, pixels")
        ->capture_default_str()
        ->check(CLI::Range(8, 64));
    app.add_option("--spp", options.spp, "samples a pixel of each result")
        ->capture_default_str()
        ->check(CLI::Range(1u, 64u));
    app.add_option("--noisy", options.noisy, "share of pixels whose feature moments are noisy")
        ->capture_default_str()
        ->check(CLI::Range(0.0, 1.0));
    app.add_option("--repeats", options.repeats, "the median is told")
        ->capture_default_str()
        ->check(CLI::Range(1, 1000));
    app.add_flag("--json", options.json, "figures as JSON");
    CLI11_PARSE(app, argc, argv);
    try {
        relume::bench::Run(options);
    } catch (const std::exception& error) {
        fmt::print(stderr, "relume-merge-speed: {}\n", error.what());
        return 1;
    }
    return 0;
}
