// relume farm: a server and workers on this machine until Ctrl-C.
#include <fmt/format.h>

#include <condition_variable>
#include <cstdio>
#include <memory>
#include <mutex>

#include "client/cli/commands.h"
#include "client/cli/exit_codes.h"
#include "client/cli/options.h"
#include "client/lib/local_farm.h"

namespace relume::client {
namespace {

int RunFarm(const FarmOptions& options, Interrupts* interrupts) {
    std::mutex mutex;
    std::condition_variable changed;
    bool stop = false;
    const auto end = [&] {
        const std::lock_guard lock(mutex);
        stop = true;
        changed.notify_all();
    };
    const Interrupts::Guard guard(interrupts, end);
    std::unique_ptr<LocalFarm> farm;
    WithExitCode(kExitServer, [&] { farm = std::make_unique<LocalFarm>(options); });
    farm->Monitor([](const std::string& words) { fmt::print(stderr, "relume: {}\n", words); },
                  [&](const std::string&) { end(); });
    fmt::print("farm on {} with {} worker{}; Ctrl-C ends it\n", farm->address(), options.workers,
               options.workers == 1 ? "" : "s");
    std::fflush(stdout);

    std::unique_lock lock(mutex);
    changed.wait(lock, [&] { return stop; });
    lock.unlock();
    if (farm->failure()) {
        throw CommandError(kExitServer, *farm->failure());
    }
    return kExitDone;
}

}  // namespace

Runner AddFarm(CLI::App* app) {
    const auto options = std::make_shared<FarmOptions>();
    options->listen = "127.0.0.1:7878";
    app->add_option("--workers", options->workers, "worker processes, 1 to 256 [1]")
        ->check(Between(1, 256))
        ->type_name("N");
    app->add_option("--threads", options->threads,
                    "threads of each of them, 1 to 1024 [the cores shared out]")
        ->check(Between(1, 1024))
        ->type_name("N");
    app->add_option("--listen", options->listen, "port 0: any free one [127.0.0.1:7878]")
        ->type_name("HOST:PORT");
    app->add_flag("--insecure", options->insecure,
                  "listen beyond this machine although nothing is encrypted");
    app->add_option("--data", options->data,
                    "the server's folder for scenes and results [one that goes with the farm]")
        ->type_name("FOLDER");
    app->add_option("--cache", options->cache,
                    "the workers' folder for scene files [one that goes with the farm]")
        ->type_name("FOLDER");
    app->add_flag("--logs", options->show_logs, "show what server and workers log");
    return [options](Interrupts* interrupts) { return RunFarm(*options, interrupts); };
}

}  // namespace relume::client
