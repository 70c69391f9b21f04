// relume-throughput: how fast a scene is traced in process, beside what bare Embree takes for the
// same rays, and what it takes of memory. docs/bench.md tells how to read it.
#include <fmt/format.h>
#include <malloc.h>

#include <CLI/CLI.hpp>
#include <algorithm>
#include <array>
#include <chrono>
#include <cstdio>
#include <filesystem>
#include <memory>
#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "bench/measure.h"
#include "bench/scene_source.h"
#include "core/base/error.h"
#include "core/base/parallel.h"
#include "core/scene/formats.h"
#include "worker/render/render.h"

namespace relume::bench {
namespace {

using Json = nlohmann::ordered_json;

struct Options {
    std::string scene, environment;
    std::string size = "640x360";
    std::vector<float> look_from, look_at{0, 0, 0};
    float fov = 40;
    std::uint32_t spp = 32, recorded_spp = 2;
    int depth = 8, threads = 2, repeats = 3;
    bool json = false;
};

double Seconds(std::chrono::steady_clock::time_point since) {
    return std::chrono::duration<double>(std::chrono::steady_clock::now() - since).count();
}

double Mega(double x) { return x / 1e6; }
double MiB(std::size_t bytes) { return static_cast<double>(bytes) / (1 << 20); }

struct SceneBytes {
    std::size_t pictures = 0;  // decoded
    std::size_t geometry = 0;  // as loaded
};

template <typename T>
std::size_t Bytes(const std::vector<T>& v) {
    return v.size() * sizeof(T);
}

SceneBytes Measure(const Scene& scene) {
    SceneBytes bytes;
    for (const SceneImage& image : scene.images) {
        bytes.pictures += Bytes(image.bytes) + Bytes(image.floats);
    }
    for (const Mesh& mesh : scene.meshes) {
        bytes.geometry += Bytes(mesh.positions) + Bytes(mesh.normals) + Bytes(mesh.uvs) +
                          Bytes(mesh.tangents) + Bytes(mesh.tangent_signs) + Bytes(mesh.triangles);
        for (const auto& positions : mesh.motion) {
            bytes.geometry += Bytes(positions);
        }
    }
    return bytes;
}

double Median(std::vector<double> v) {
    std::sort(v.begin(), v.end());
    const std::size_t n = v.size();
    return n % 2 == 1 ? v[n / 2] : (v[n / 2 - 1] + v[n / 2]) / 2;
}

Cost Median(const std::vector<Cost>& costs) {
    std::vector<double> wall, cpu;
    for (const Cost& cost : costs) {
        wall.push_back(cost.wall);
        cpu.push_back(cost.cpu);
    }
    return {Median(wall), Median(cpu), costs.front().rays};
}

// One line of the table and its JSON. By CPU time: what `threads` cores would do that have nothing
// else to do.
Json Speed(const char* what, const Cost& cost, double paths, int threads, bool print) {
    const double rays = static_cast<double>(cost.rays), cpu = cost.cpu / threads;
    Json json{{"threads", threads},
              {"wall_seconds", cost.wall},
              {"cpu_seconds", cost.cpu},
              {"rays", cost.rays},
              {"rays_per_second", rays / cost.wall},
              {"rays_per_second_by_cpu", rays / cpu}};
    if (paths > 0) {
        json["paths_per_second"] = paths / cost.wall;
        json["paths_per_second_by_cpu"] = paths / cpu;
    }
    if (print) {
        const std::string mega_paths =
            paths > 0 ? fmt::format("{:8.3f} {:8.3f}", Mega(paths / cost.wall), Mega(paths / cpu))
                      : std::string(17, ' ');
        fmt::print("{:<22}{:>3}  {:9.2f} {:9.2f}  {}  {:8.2f} {:8.2f}\n", what, threads, cost.wall,
                   cost.cpu, mega_paths, Mega(rays / cost.wall), Mega(rays / cpu));
    }
    return json;
}

void Run(const Options& options) {
    // As relume-worker does, so that memory is what it has there.
    mallopt(M_MMAP_THRESHOLD, 1 << 20);
    mallopt(M_TRIM_THRESHOLD, 128 << 20);
    SetThreadCount(std::max(options.threads, 4));

    RenderSettings settings =
        ViewSettings(options.size, options.look_from, options.look_at, options.fov);
    settings.max_depth = options.depth;

    // Load and build.
    auto start = std::chrono::steady_clock::now();
    const SceneAndEnvironment files(options.scene, options.environment);
    LoadOptions load;
    load.environment = files.environment_name();
    Scene scene = LoadScene(files, std::filesystem::path(options.scene).filename().string(), load);
    const double load_seconds = Seconds(start);
    const SceneBytes bytes = Measure(scene);
    const std::uint64_t triangles = scene.TriangleCount();
    start = std::chrono::steady_clock::now();
    const render::Renderer renderer(std::make_shared<render::BuiltScene>(std::move(scene)),
                                    settings);
    const double build_seconds = Seconds(start);

    // Threads of both numbers in turn.
    const TileRect window = settings.Window();
    std::vector<int> counts{1};
    if (options.threads > 1) {
        counts.push_back(options.threads);
    }
    std::vector<std::vector<Cost>> renders(counts.size());
    for (int repeat = 0; repeat < options.repeats; ++repeat) {
        for (std::size_t i = 0; i < counts.size(); ++i) {
            renders[i].push_back(Render(renderer, window, options.spp, counts[i]));
        }
    }
    const std::size_t peak = PeakMemory();

    // The same rays with and without the renderer.
    std::vector<RayLog> logs;
    Render(renderer, window, options.recorded_spp, options.threads, &logs);
    std::vector<Cost> with, bare;
    std::vector<double> share_wall, share_cpu;
    for (int repeat = 0; repeat < 2 * options.repeats + 1; ++repeat) {
        with.push_back(Render(renderer, window, options.recorded_spp, options.threads));
        bare.push_back(ReplayAll(logs, options.threads));
        share_wall.push_back(bare.back().wall / with.back().wall);
        share_cpu.push_back(bare.back().cpu / with.back().cpu);
    }
    std::uint64_t shadow = 0;
    for (const RayLog& log : logs) {
        shadow += static_cast<std::uint64_t>(std::count_if(log.rays.begin(), log.rays.end(),
                                                           [](const auto& r) { return r.shadow; }));
    }

    // Tell.
    const bool print = !options.json;
    const double paths = static_cast<double>(window.area()) * options.spp;
    const double recorded = static_cast<double>(window.area()) * options.recorded_spp;
    if (print) {
        fmt::print(
            "{}, {}x{}, {} spp, {} segments, {} triangles; loaded in {:.2f} s, built in {:.2f} "
            "s\n\n",
            options.scene, settings.width, settings.height, options.spp, options.depth, triangles,
            load_seconds, build_seconds);
        fmt::print("{:<20}threads  seconds   CPU sec.  Mpaths/s   by CPU   Mrays/s   by CPU\n", "");
    }
    Json json{{"scene", options.scene},       {"width", settings.width},
              {"height", settings.height},    {"spp", options.spp},
              {"segments", options.depth},    {"triangles", triangles},
              {"load_seconds", load_seconds}, {"build_seconds", build_seconds}};
    for (std::size_t i = 0; i < counts.size(); ++i) {
        json["render"].push_back(Speed("render", Median(renders[i]), paths, counts[i], print));
    }
    json["recorded"] =
        Speed("render, recorded part", Median(with), recorded, options.threads, print);
    json["bare"] = Speed("bare Embree, the same", Median(bare), 0, options.threads, print);
    json["share_of_bare"] = Median(share_wall);
    json["share_of_bare_by_cpu"] = Median(share_cpu);
    json["rays_a_path"] = static_cast<double>(bare.front().rays) / recorded;
    json["shadow_rays_a_path"] = static_cast<double>(shadow) / recorded;
    if (print) {
        fmt::print(
            "\nshare of bare Embree   {:.3f} by wall time, {:.3f} by CPU time; {:.2f} rays a path, "
            "{:.2f} of them shadow rays\n",
            Median(share_wall), Median(share_cpu), json["rays_a_path"].get<double>(),
            json["shadow_rays_a_path"].get<double>());
    }
    if (counts.size() > 1) {
        const Cost one = Median(renders[0]), all = Median(renders[1]);
        const double wall = one.wall / all.wall, cpu = options.threads * one.cpu / all.cpu;
        json["scaling"] = wall;
        json["scaling_by_cpu"] = cpu;
        if (print) {
            fmt::print("scaling 1 -> {} threads {:.2f} by wall time, {:.2f} by CPU time\n",
                       options.threads, wall, cpu);
        }
    }
    const std::size_t needed = bytes.pictures + EmbreeBytes() + bytes.geometry;
    const double ratio = static_cast<double>(peak) / static_cast<double>(needed);
    json["memory"] = {{"peak", peak},
                      {"pictures", bytes.pictures},
                      {"geometry", bytes.geometry},
                      {"embree", EmbreeBytes()},
                      {"embree_peak", EmbreePeakBytes()},
                      {"ratio", ratio}};
    if (print) {
        fmt::print(
            "memory (MiB)           peak {:.0f} = {:.2f} x (pictures {:.0f} + Embree {:.0f} + "
            "geometry {:.0f}); Embree's peak {:.0f}\n",
            MiB(peak), ratio, MiB(bytes.pictures), MiB(EmbreeBytes()), MiB(bytes.geometry),
            MiB(EmbreePeakBytes()));
    } else {
        fmt::print("{}\n", json.dump(2));
    }
}

}  // namespace
}  // namespace relume::bench

int main(int argc, char** argv) {
    relume::bench::Options options;
    CLI::App app{"Renders a scene in process: speed, share of bare Embree, scaling, memory."};
    app.add_option("scene", options.scene, "scene file")->required();
    app.add_option("--environment", options.environment, "latitude-longitude map that lights it");
    app.add_option("--size", options.size, "WxH")->capture_default_str();
    app.add_option("--spp", options.spp, "samples a pixel")
        ->capture_default_str()
        ->check(CLI::Range(1u, 65536u));
    app.add_option("--recorded-spp", options.recorded_spp,
                   "of which rays are recorded, 40 bytes a ray")
        ->capture_default_str()
        ->check(CLI::Range(1u, 64u));
    app.add_option("--max-depth", options.depth, "longest path in segments")->capture_default_str();
    app.add_option("--threads", options.threads, "measured beside one thread")
        ->capture_default_str()
        ->check(CLI::Range(1, 1024));
    app.add_option("--repeats", options.repeats, "medians are of that many")
        ->capture_default_str()
        ->check(CLI::Range(1, 1000));
    app.add_option("--look-from", options.look_from, "x,y,z: a camera in place of the scene's")
        ->delimiter(',')
        ->expected(3);
    app.add_option("--look-at", options.look_at, "x,y,z")->delimiter(',')->expected(3);
    app.add_option("--fov", options.fov, "its vertical angle in degrees")->capture_default_str();
    app.add_flag("--json", options.json, "figures as JSON");
    CLI11_PARSE(app, argc, argv);
    try {
        relume::bench::Run(options);
    } catch (const std::exception& error) {
        fmt::print(stderr, "relume-throughput: {}\n", error.what());
        return 1;
    }
    return 0;
}
