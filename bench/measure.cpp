#include "bench/measure.h"

#include <atomic>
#include <chrono>
#include <ctime>
#include <fstream>
#include <functional>
#include <string>
#include <thread>

#include "core/base/cancel_token.h"
#include "worker/render/floating_point_mode.h"

namespace relume::bench {
namespace {

constexpr int kTileSize = 32;  // the farm's default

double ThreadSeconds() {
    timespec t{};
    clock_gettime(CLOCK_THREAD_CPUTIME_ID, &t);
    return static_cast<double>(t.tv_sec) + 1e-9 * static_cast<double>(t.tv_nsec);
}

// Calls work(i) for all i below `count`, each on the thread that is free next; `work` answers with
// a number of rays.
Cost Measure(std::size_t count, int threads,
             const std::function<std::uint64_t(std::size_t)>& work) {
    std::atomic<std::size_t> next{0};
    std::vector<Cost> costs(static_cast<std::size_t>(threads));
    const auto start = std::chrono::steady_clock::now();
    {
        std::vector<std::jthread> running;
        for (Cost& cost : costs) {
            running.emplace_back([&] {
                const double began = ThreadSeconds();
                for (std::size_t i = next++; i < count; i = next++) {
                    cost.rays += work(i);
                }
                cost.cpu = ThreadSeconds() - began;
            });
        }
    }
    Cost all;
    all.wall = std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
    for (const Cost& cost : costs) {
        all.cpu += cost.cpu;
        all.rays += cost.rays;
    }
    return all;
}

}  // namespace

Cost Render(const render::Renderer& renderer, const TileRect& window, std::uint32_t spp,
            int threads, std::vector<RayLog>* logs) {
    const std::vector<TileRect> tiles = CutIntoTiles(window, kTileSize);
    if (logs != nullptr) {
        logs->assign(tiles.size(), {});
    }
    const CancelToken never;
    return Measure(tiles.size(), threads, [&](std::size_t i) {
        TileTask task;
        task.rect = tiles[i];
        task.first.assign(tiles[i].area(), 0);
        task.count.assign(tiles[i].area(), spp);
        RecordRays(logs != nullptr ? &(*logs)[i] : nullptr);
        const TileResult result = renderer.RenderTile(task, never);
        RecordRays(nullptr);
        return result.rays;
    });
}

Cost ReplayAll(const std::vector<RayLog>& logs, int threads) {
    return Measure(logs.size(), threads, [&](std::size_t i) {
        const render::FloatingPointMode mode;
        // What it answers is used, so that no compiler leaves the tracing out.
        return Replay(logs[i]) <= logs[i].rays.size() ? logs[i].rays.size() : std::size_t{0};
    });
}

std::size_t PeakMemory() {
    std::ifstream status("/proc/self/status");
    for (std::string word; status >> word;) {
        if (word == "VmHWM:") {
            std::size_t kib = 0;
            status >> kib;
            return kib * 1024;
        }
    }
    return 0;
}

}  // namespace relume::bench
