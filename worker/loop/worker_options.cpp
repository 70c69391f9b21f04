#include "worker/loop/worker_options.h"

#include <fmt/format.h>
#include <grpcpp/create_channel.h>

#include <utility>

#include "core/trust/loopback.h"
#include "proto/channel/credentials.h"

namespace relume::worker {

WorkerOptions Checked(WorkerOptions options) {
    if (!options.join_token.empty() && !options.tls.enabled() &&
        !IsLoopbackHost(SplitHostPort(options.server).first)) {
        ThrowInvalidArgument(
            fmt::format("--join-token: would cross the network to {} in the clear; give --tls-ca, "
                        "too",
                        options.server));
    }
    return options;
}

std::shared_ptr<grpc::Channel> MakeChannel(const WorkerOptions& options) {
    grpc::ChannelArguments arguments;
    arguments.SetInt(GRPC_ARG_KEEPALIVE_TIME_MS, 20'000);
    arguments.SetInt(GRPC_ARG_KEEPALIVE_TIMEOUT_MS, 10'000);
    arguments.SetInt(GRPC_ARG_HTTP2_MAX_PINGS_WITHOUT_DATA, 0);
    arguments.SetInt(GRPC_ARG_INITIAL_RECONNECT_BACKOFF_MS, 100);
    arguments.SetInt(GRPC_ARG_MIN_RECONNECT_BACKOFF_MS, 100);
    arguments.SetInt(GRPC_ARG_MAX_RECONNECT_BACKOFF_MS, 5'000);
    return grpc::CreateCustomChannel(
        options.server,
        options.tls_files.ca.empty()
            ? channel::MakeCredentials(options.tls)
            : channel::MakeRenewedCredentials(options.tls_files, options.tls_refresh_seconds),
        arguments);
}

Error ExplainEnd(const WorkerOptions& options, const grpc::Status& status) {
    if (status.ok()) {
        return {ErrorCode::kUnavailable, options.server + ": the server has ended the connection"};
    }
    if (options.tls_files.ca.empty() || status.error_code() != grpc::StatusCode::UNAVAILABLE) {
        return channel::ExplainStatus(status, options.server, options.tls);
    }
    try {
        return channel::ExplainStatus(status, options.server, LoadClientTls(options.tls_files));
    } catch (const Error& error) {
        return error;
    }
}

}  // namespace relume::worker
