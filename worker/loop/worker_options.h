#pragma once

#include <grpcpp/channel.h>
#include <grpcpp/support/status.h>

#include <cstdint>
#include <filesystem>
#include <memory>
#include <string>

#include "core/base/error.h"
#include "core/trust/tls_files.h"

namespace relume::worker {

struct WorkerOptions {
    std::string server;   // HOST:PORT
    std::string name;     // what the server calls it, made unique there
    int threads = 1;      // render threads
    std::string isa;      // of the numeric class
    std::string machine;  // MachineId
    std::filesystem::path cache_folder;
    std::uint64_t cache_bytes = std::uint64_t{8} << 30;
    TlsPems tls;
    // Where `tls` came from: looked at again every so many seconds, so that renewed certificates
    // count when it connects again. Not named: never.
    TlsFiles tls_files;
    int tls_refresh_seconds = 10;
    std::string join_token;  // shown to the server; "": none
};

// The options, if they can be used. Throws kInvalidArgument if a join token would cross a network
// in the clear.
WorkerOptions Checked(WorkerOptions options);

// A channel to the server that stays open, and comes back soon after the server does.
std::shared_ptr<grpc::Channel> MakeChannel(const WorkerOptions& options);

// Why a stream of that channel ended, or never began: what is wrong with our own certificate now,
// or else with the server.
Error ExplainEnd(const WorkerOptions& options, const grpc::Status& status);

}  // namespace relume::worker
