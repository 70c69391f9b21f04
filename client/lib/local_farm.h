#pragma once

#include <atomic>
#include <functional>
#include <memory>
#include <mutex>
#include <optional>
#include <string>
#include <thread>
#include <vector>

#include "client/lib/child_process.h"
#include "core/base/files.h"

namespace relume::client {

struct FarmOptions {
    int workers = 1;
    int threads = 0;                     // of each worker; 0: the cores shared out
    std::string listen = "127.0.0.1:0";  // of the server; port 0: any free one
    std::string data;                    // the server's folder; "" = a temporary one
    std::string cache;                   // the workers' cache; "" = a temporary one
    bool insecure = false;               // listen beyond loopback without TLS
    bool show_logs = false;              // children write to this process's stderr
};

// A server and its workers as processes on this machine, gone with the object and with this
// process. Make it before gRPC is used.
class LocalFarm {
  public:
    // Throws Error with the last words of what did not start.
    explicit LocalFarm(const FarmOptions& options);
    ~LocalFarm();

    const std::string& address() const { return address_; }

    // Calls `on_lost` for a worker that ended while others still work, and `on_failure`, once, when
    // the farm can't work any more: its server or its last worker has ended. On a thread of the
    // farm's own.
    void Monitor(std::function<void(const std::string&)> on_lost,
                 std::function<void(const std::string&)> on_failure);

    // What on_failure was told.
    std::optional<std::string> failure() const;

  private:
    void MonitorThread();

    const bool keeps_data_;  // beyond this object
    std::unique_ptr<TemporaryFolder> folder_;
    std::unique_ptr<ChildProcess> server_;
    std::vector<std::unique_ptr<ChildProcess>> workers_;
    std::string address_;

    std::function<void(const std::string&)> on_lost_, on_failure_;
    std::atomic<bool> stop_{false};
    std::thread monitor_;
    mutable std::mutex mutex_;  // guards failure_
    std::optional<std::string> failure_;
};

}  // namespace relume::client
