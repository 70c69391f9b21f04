#include "client/lib/local_farm.h"

#include <fmt/format.h>
#include <unistd.h>

#include <algorithm>
#include <chrono>
#include <csignal>

#include "core/base/error.h"
#include "core/base/resources.h"

namespace relume::client {
namespace {

constexpr double kStartSeconds = 20;
constexpr double kStopSeconds = 5;
// Where nothing is kept nobody waits for a good end: gRPC's own takes seconds at times.
constexpr double kStopTemporarySeconds = 0.05;
constexpr std::chrono::milliseconds kMonitorInterval{50};

}  // namespace

LocalFarm::LocalFarm(const FarmOptions& options) : keeps_data_(!options.data.empty()) {
    std::string data = options.data, cache = options.cache;
    if (data.empty() || cache.empty()) {
        folder_ = std::make_unique<TemporaryFolder>();
        data = data.empty() ? (folder_->path() / "data").string() : data;
        cache = cache.empty() ? (folder_->path() / "cache").string() : cache;
    }
    const std::string level = options.show_logs ? "info" : "warn";

    // With its pid, they see that this process has ended even if it did so before they were up.
    const std::string with_parent = fmt::format("--with-parent={}", getpid());

    std::vector<std::string> arguments{"--listen",  options.listen, "--data", data,
                                       with_parent, "--log-level",  level};
    if (!keeps_data_) {
        arguments.insert(arguments.end(), {"--save-every", "0", "--cross-check", "0"});
    }
    if (options.insecure) {
        arguments.push_back("--insecure");
    }
    server_ = std::make_unique<ChildProcess>(ProgramBeside("relume-server"), arguments,
                                             options.show_logs);
    const auto line = server_->ReadLine(kStartSeconds);
    const std::string key = "listening on ";
    if (!line || line->find(key) == std::string::npos) {
        server_->Terminate(0.5);
        throw Error(ErrorCode::kInternal,
                    fmt::format("the local server did not start: it {}", server_->LastWords()));
    }
    address_ = line->substr(line->find(key) + key.size());

    const int cores = AvailableResources().cores;
    const int threads =
        options.threads > 0 ? options.threads : std::max(1, cores / options.workers);
    for (int i = 0; i < options.workers; ++i) {
        workers_.push_back(std::make_unique<ChildProcess>(
            ProgramBeside("relume-worker"),
            std::vector<std::string>{"--server", address_, "--threads", std::to_string(threads),
                                     "--name", fmt::format("local-{}", i + 1), "--cache", cache,
                                     with_parent, "--log-level", level},
            options.show_logs));
    }
}

LocalFarm::~LocalFarm() {
    stop_ = true;
    if (monitor_.joinable()) {
        monitor_.join();
    }
    for (const auto& worker : workers_) {
        worker->Signal(SIGTERM);
    }
    if (!keeps_data_ && server_) {
        server_->Signal(SIGTERM);
    }
    const double patience = keeps_data_ ? kStopSeconds : kStopTemporarySeconds;
    for (const auto& worker : workers_) {
        worker->Terminate(patience);
    }
    if (server_) {
        server_->Terminate(patience);
    }
}

void LocalFarm::Monitor(std::function<void(const std::string&)> on_lost,
                        std::function<void(const std::string&)> on_failure) {
    on_lost_ = std::move(on_lost);
    on_failure_ = std::move(on_failure);
    monitor_ = std::thread([this] { MonitorThread(); });
}

void LocalFarm::MonitorThread() {
    const auto fail = [this](const std::string& message) {
        {
            const std::lock_guard lock(mutex_);
            failure_ = message;
        }
        on_failure_(message);
    };
    std::vector<bool> lost(workers_.size(), false);
    while (!stop_) {
        if (server_->Ended()) {
            fail("the local server " + server_->LastWords());
            return;
        }
        for (std::size_t i = 0; i < workers_.size(); ++i) {
            if (lost[i] || !workers_[i]->Ended()) {
                continue;
            }
            lost[i] = true;
            const auto left = std::count(lost.begin(), lost.end(), false);
            const std::string words = fmt::format("worker {} {}", i + 1, workers_[i]->LastWords());
            if (left == 0) {
                fail(words + "; no worker is left");
                return;
            }
            on_lost_(fmt::format("{}; {} left", words, left));
        }
        std::this_thread::sleep_for(kMonitorInterval);
    }
}

std::optional<std::string> LocalFarm::failure() const {
    const std::lock_guard lock(mutex_);
    return failure_;
}

}  // namespace relume::client
