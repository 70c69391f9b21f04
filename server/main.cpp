// relume-server: the coordinator as a service. Takes jobs, lends them to workers, filters and keeps
// the images.
#include <fmt/format.h>
#include <grpc/support/log.h>
#include <malloc.h>
#include <unistd.h>

#include <CLI/CLI.hpp>
#include <csignal>
#include <cstdio>
#include <cstdlib>
#include <filesystem>
#include <future>
#include <string>
#include <utility>

#include "core/base/error.h"
#include "core/base/log.h"
#include "core/base/parallel.h"
#include "core/base/signals.h"
#include "core/trust/join_token.h"
#include "core/trust/tls_files.h"
#include "proto/codec/protocol.h"
#include "server/jobs/planner.h"
#include "server/rpc/access.h"
#include "server/rpc/listen_address.h"
#include "server/rpc/server.h"

namespace {

// $XDG_STATE_HOME/relume/server, ~/.local/state/relume/server, or a folder of this user's in the
// temporary one.
std::filesystem::path DefaultData() {
    if (const char* state = std::getenv("XDG_STATE_HOME"); state != nullptr && *state != '\0') {
        return std::filesystem::path(state) / "relume" / "server";
    }
    if (const char* home = std::getenv("HOME"); home != nullptr && *home != '\0') {
        return std::filesystem::path(home) / ".local" / "state" / "relume" / "server";
    }
    return std::filesystem::temp_directory_path() / fmt::format("relume-server-{}", getuid());
}

}  // namespace

int main(int argc, char** argv) {
    relume::server::ServerOptions options;
    relume::TlsFiles tls;
    std::string join_token;
    std::string listen = "127.0.0.1:7878", data = DefaultData().string(), log_level = "info",
                log_format = "text", metrics;
    bool insecure = false, describe_samplers = false;
    relume::LogFormat format = relume::LogFormat::kText;
    int threads = 0;

    int with_parent = 0;  // 1, or the pid of the parent

    CLI::App app{
        "Takes jobs, lends their pixels to relume-workers, and filters and keeps the images."};
    app.set_version_flag("--version", relume::kBuild);
    app.add_option("--listen", listen, "HOST:PORT; port 0 = any free one")->capture_default_str();
    app.add_option("--data", data, "folder for scenes and results")->capture_default_str();
    app.add_option("--blob-quota", options.coordinator.blob_quota,
                   "largest size of all scene files, e.g. 64G")
        ->transform(CLI::AsSizeValue(false))
        ->default_str("64G");
    app.add_option("--save-every", options.coordinator.films.save_seconds,
                   "least seconds between saves of a job's film; what came after the last one is "
                   "rendered again if the server dies; 0: films are not saved")
        ->capture_default_str()
        ->check(CLI::Range(0.0, 86400.0));
    app.add_option("--film-quota", options.coordinator.films.quota,
                   "largest size of the films of jobs that are over, kept so that they can be "
                   "extended, e.g. 16G; the oldest go first")
        ->transform(CLI::AsSizeValue(false))
        ->default_str("16G");
    app.add_option("--film-memory", options.coordinator.quotas.film_memory,
                   "largest size of the films of all jobs under way, in memory, e.g. 8G: further "
                   "jobs wait [half of this machine's memory]")
        ->transform(CLI::AsSizeValue(false));
    options.coordinator.cross_check = 0.01;
    app.add_option("--cross-check", options.coordinator.cross_check,
                   "share of the work that two workers render, on two machines if there are: it "
                   "counts when their answers are equal, and who is found wrong gets no more")
        ->capture_default_str()
        ->check(CLI::Range(0.0, 1.0));
    app.add_option("--client-jobs", options.coordinator.quotas.client_jobs,
                   "most jobs of one client that are not over")
        ->capture_default_str()
        ->check(CLI::PositiveNumber);
    app.add_option("--jobs", options.coordinator.quotas.jobs,
                   "most jobs of all clients that are not over")
        ->capture_default_str()
        ->check(CLI::PositiveNumber);
    app.add_option("--client-streams", options.coordinator.quotas.client_streams,
                   "most streams that one address may have open: workers, watches, transfers")
        ->capture_default_str()
        ->check(CLI::PositiveNumber);
    app.add_option("--max-pixels", options.coordinator.quotas.pixels, "most pixels of one image")
        ->capture_default_str()
        ->check(CLI::PositiveNumber);
    app.add_option("--tls-cert", tls.cert, "certificate of this server (PEM): all is encrypted")
        ->type_name("FILE");
    app.add_option("--tls-key", tls.key, "its private key (PEM)")->type_name("FILE");
    app.add_option("--tls-ca", tls.ca,
                   "let in those with a certificate of this CA alone (PEM), each in the role that "
                   "its certificate tells")
        ->type_name("FILE");
    app.add_option("--join-token", join_token,
                   "secret that workers must show, too: a file with one line")
        ->type_name("FILE");
    app.add_option(
        "--metrics", metrics,
        "HOST:PORT of a page for Prometheus, by plain HTTP; port 0 = any free one [none]");
    app.add_flag("--insecure", insecure,
                 "listen beyond this machine although nothing is encrypted");
    app.add_option("--threads", threads, "threads for planning and filtering; 0 = one a core")
        ->capture_default_str()
        ->check(CLI::Range(0, 1024));
    app.add_option("--log-level", log_level, "trace, debug, info, warn, error or off")
        ->capture_default_str();
    app.add_option("--log-format", log_format, "text, or json: a JSON object a line")
        ->capture_default_str();
    app.add_flag("--with-parent", with_parent,
                 "stop with the process that started this one; =PID: and at once, if that is not "
                 "its parent");
    app.add_flag("--describe-samplers", describe_samplers,
                 "list the samplers and their parameters");
    try {
        app.parse(argc, argv);
    } catch (const CLI::ParseError& error) {
        return app.exit(error) == 0 ? 0 : 2;
    }

    if (describe_samplers) {
        fmt::print("{}", relume::jobs::DescribePlanners());
        return 0;
    }
    if (with_parent != 0) {
        relume::EndWithParent(SIGTERM, with_parent);
    }
    std::signal(SIGPIPE, SIG_IGN);
    // Buffers of a few hundred KB come and go with each lease: they are kept, not given back to the
    // kernel and cleared by it again. By all threads in common: each would keep tens of megabytes.
    mallopt(M_ARENA_MAX, 1);
    mallopt(M_MMAP_THRESHOLD, 32 << 20);
    mallopt(M_TRIM_THRESHOLD, 128 << 20);
    try {
        format = relume::ParseLogFormat(log_format);
        relume::InitLogging("relume-server", log_level, format);
        // What gRPC has to say is for its developers; what goes wrong is said by us.
        gpr_set_log_function(
            [](gpr_log_func_args* args) { relume::server::LogGrpcMessage(args->message); });
        std::promise<int> stop;
        bool stopped = false;
        const relume::SignalWatcher signals([&](int signal) {
            if (!std::exchange(stopped, true)) {
                stop.set_value(signal);
            }
        });
        relume::SetThreadCount(threads);

        options.listen = relume::server::ParseListenAddress(listen);
        options.tls = relume::LoadServerTls(tls);
        options.tls_files = tls;
        relume::server::CheckExposure(options.listen, options.tls.enabled(), insecure,
                                      !join_token.empty());
        if (!join_token.empty()) {
            options.join_token = relume::ReadJoinToken(join_token);
        }
        if (options.tls.enabled() && options.tls.ca.empty()) {
            spdlog::warn("without --tls-ca everybody who reaches this server may use it");
        }
        if (!metrics.empty()) {
            options.metrics = relume::server::ParseListenAddress(metrics);
            if (!insecure && !relume::server::IsLoopback(*options.metrics)) {
                relume::ThrowInvalidArgument(
                    fmt::format("--metrics {}: others could read it and nothing is encrypted; add "
                                "--insecure if the network is trusted",
                                metrics));
            }
        }
        options.coordinator.data = data;
        const relume::server::Server server(options);
        fmt::print("relume-server listening on {}\n", relume::server::ToString(server.address()));
        std::fflush(stdout);

        const int signal = stop.get_future().get();
        spdlog::info("stops: signal {}", signal);
    } catch (const std::exception& error) {
        relume::LogFatal("relume-server", error.what(), format);
        return 1;
    }
    return 0;
}
