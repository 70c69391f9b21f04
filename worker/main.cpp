// relume-worker: renders leases for a server until it is told to stop.
#include <fmt/format.h>
#include <grpc/support/log.h>
#include <malloc.h>
#include <sys/prctl.h>
#include <unistd.h>

#include <CLI/CLI.hpp>
#include <algorithm>
#include <csignal>
#include <cstdint>
#include <cstdlib>
#include <filesystem>
#include <limits>
#include <memory>
#include <mutex>
#include <thread>

#include "core/base/error.h"
#include "core/base/log.h"
#include "core/base/parallel.h"
#include "core/base/resources.h"
#include "core/base/signals.h"
#include "core/trust/join_token.h"
#include "core/trust/tls_files.h"
#include "proto/codec/protocol.h"
#include "worker/loop/crash_report.h"
#include "worker/loop/machine.h"
#include "worker/loop/worker.h"
#include "worker/render/render.h"

namespace {

constexpr int kBuildThreads = 4;
constexpr std::uint64_t kLeastMemory = std::uint64_t{512} << 20;

std::string HostAndPid() {
    char host[256] = "worker";
    gethostname(host, sizeof host - 1);
    return fmt::format("{}:{}", host, getpid());
}

// $XDG_CACHE_HOME/relume, ~/.cache/relume, or a folder of this user's in the temporary one.
std::filesystem::path DefaultCache() {
    if (const char* cache = std::getenv("XDG_CACHE_HOME"); cache != nullptr && *cache != '\0') {
        return std::filesystem::path(cache) / "relume";
    }
    if (const char* home = std::getenv("HOME"); home != nullptr && *home != '\0') {
        return std::filesystem::path(home) / ".cache" / "relume";
    }
    return std::filesystem::temp_directory_path() / fmt::format("relume-cache-{}", getuid());
}

}  // namespace

int main(int argc, char** argv) {
    relume::worker::WorkerOptions options;
    options.name = HostAndPid();
    relume::TlsFiles tls;
    std::string join_token;
    std::string cache = DefaultCache().string();
    std::string log_level = "info", log_format = "text";
    relume::LogFormat format = relume::LogFormat::kText;

    constexpr std::uint64_t kUnset = std::numeric_limits<std::uint64_t>::max();
    std::uint64_t memory_limit = kUnset;
    int with_parent = 0;  // 1, or the pid of the parent

    CLI::App app{
        "Renders leases for a relume-server. SIGTERM: hands back what has not begun and leaves."};
    app.set_version_flag("--version", relume::kBuild);
    app.add_option("--server", options.server, "HOST:PORT of the server")
        ->envname("RELUME_SERVER")
        ->required();
    app.add_option("--tls-ca", tls.ca, "CA of the server's certificate (PEM): all is encrypted")
        ->envname("RELUME_TLS_CA")
        ->type_name("FILE");
    app.add_option("--tls-cert", tls.cert, "certificate of this worker (PEM)")
        ->envname("RELUME_TLS_CERT")
        ->type_name("FILE");
    app.add_option("--tls-key", tls.key, "its private key (PEM)")
        ->envname("RELUME_TLS_KEY")
        ->type_name("FILE");
    app.add_option("--join-token", join_token,
                   "secret that the server asks workers for: a file with one line")
        ->envname("RELUME_JOIN_TOKEN")
        ->type_name("FILE");
    app.add_option("--memory-limit", memory_limit,
                   "most memory that this worker may take, e.g. 8G: a scene that needs more goes "
                   "elsewhere; 0: no limit [nine tenths of the container's or machine's]")
        ->transform(CLI::AsSizeValue(false));
    app.add_option("--threads", options.threads,
                   "render threads; 0 = one for each core that it may use")
        ->default_val(0)
        ->check(CLI::Range(0, 1024));
    app.add_option("--name", options.name, "what the server calls this worker [host:pid]");
    app.add_option("--cache", cache, "folder for scene files; workers of a machine may share it")
        ->capture_default_str();
    app.add_option("--cache-size", options.cache_bytes, "largest size of that folder, e.g. 8G")
        ->transform(CLI::AsSizeValue(false))
        ->default_str("8G");
    app.add_option("--log-level", log_level, "trace, debug, info, warn, error or off")
        ->capture_default_str();
    app.add_option("--log-format", log_format, "text, or json: a JSON object a line")
        ->capture_default_str();
    app.add_flag(
        "--with-parent", with_parent,
        "die with the process that started this one; =PID: and at once, if that is not its parent");
    try {
        app.parse(argc, argv);
    } catch (const CLI::ParseError& error) {
        return app.exit(error) == 0 ? 0 : 2;
    }

    if (with_parent != 0) {
        relume::EndWithParent(SIGKILL, with_parent);
    }
    std::signal(SIGPIPE, SIG_IGN);
    // Buffers of a few hundred KB come and go with each lease: they are kept, not given back to the
    // kernel and cleared by it again. Pictures are larger, and go back as they are converted.
    mallopt(M_MMAP_THRESHOLD, 1 << 20);
    mallopt(M_TRIM_THRESHOLD, 128 << 20);
    try {
        format = relume::ParseLogFormat(log_format);
        relume::InitLogging("relume-worker", log_level, format);
        relume::SetLogWorker(options.name);
        // What gRPC has to say is for its developers; what goes wrong is said by us.
        gpr_set_log_function(
            [](gpr_log_func_args* args) { spdlog::debug("gRPC: {}", args->message); });
        // Before any thread starts: all inherit that the signals are blocked.
        std::mutex mutex;
        relume::worker::Worker* running = nullptr;  // guarded by mutex
        bool stopped = false;                       // likewise
        relume::SignalWatcher signals([&](int) {
            const std::lock_guard lock(mutex);
            stopped = true;
            if (running != nullptr) {
                running->Stop();
            }
        });

        options.tls = relume::LoadClientTls(tls);
        options.tls_files = tls;
        if (!join_token.empty()) {
            options.join_token = relume::ReadJoinToken(join_token);
        }
        const relume::Resources resources = relume::AvailableResources();
        if (options.threads == 0) {
            options.threads = resources.cores;
        }
        if (memory_limit == kUnset) {
            memory_limit = resources.memory / 10 * 9;
        }
        if (memory_limit != 0) {
            if (memory_limit < kLeastMemory) {
                relume::ThrowInvalidArgument(fmt::format(
                    "--memory-limit {}: a worker needs 512M at least; 0 = no limit", memory_limit));
            }
            relume::LimitData(memory_limit);
        }
        if (geteuid() == 0) {
            spdlog::warn("runs as root, and scenes come from others: use an account of its own");
        }
        prctl(PR_SET_NO_NEW_PRIVS, 1, 0, 0, 0);  // of all that is ever started from here
        // Scenes are built by several tasks; TBB warns of limits below that.
        relume::SetThreadCount(std::max(options.threads, kBuildThreads));
        relume::render::CheckCpu();
        options.isa = relume::render::kIsa;
        options.cache_folder = cache;
        options.machine = relume::worker::MachineId();
        relume::worker::Worker worker(options, relume::worker::MakeSceneLoader());
        // However this ends, a further signal finds no dying worker.
        const std::shared_ptr<void> unregister(nullptr, [&](void*) {
            const std::lock_guard lock(mutex);
            running = nullptr;
        });
        {
            const std::lock_guard lock(mutex);
            running = &worker;
            if (stopped) {
                return 0;
            }
        }
        const relume::worker::CrashReporter crashes(
            [&](const relume::worker::Crash& crash) { worker.SayLastWords(crash); });
        worker.Run();
        spdlog::info("done");
        if (worker.loading()) {
            // A scene half loaded can't be interrupted, and nothing depends on how it ends.
            std::_Exit(0);
        }
    } catch (const std::exception& error) {
        relume::LogFatal("relume-worker", error.what(), format);
        return 1;
    }
    return 0;
}
