#include "server/rpc/server.h"

#include <fmt/format.h>
#include <grpcpp/ext/proto_server_reflection_plugin.h>
#include <grpcpp/health_check_service_interface.h>
#include <grpcpp/security/server_credentials.h>
#include <grpcpp/security/tls_certificate_provider.h>
#include <grpcpp/security/tls_credentials_options.h>
#include <grpcpp/server_builder.h>

#include <chrono>
#include <future>
#include <thread>

#include "core/base/error.h"
#include "core/base/log.h"

namespace relume::server {
namespace {

using std::chrono::milliseconds;

constexpr int kMaxMessage = 4 << 20;
constexpr int kMaxStreams = 256;          // at once, of one connection
constexpr milliseconds kDrainTime{1500};  // for workers to finish their leases
constexpr milliseconds kDrainInterval{20};
constexpr std::chrono::seconds kSaveTime{6};  // for what came in since the last saves
constexpr milliseconds kGoodbyeTime{500};     // then calls are cut off

// gRPC reads the files itself, and goes on with what it had if they can't be read or don't fit.
std::shared_ptr<grpc::ServerCredentials> MakeRenewedCredentials(const ServerOptions& server) {
    using namespace grpc::experimental;  // as it still is in 1.51
    const TlsFiles& files = server.tls_files;
    TlsServerCredentialsOptions options(std::make_shared<FileWatcherCertificateProvider>(
        files.key, files.cert, files.ca, static_cast<unsigned>(server.tls_refresh_seconds)));
    options.watch_identity_key_cert_pairs();
    if (files.ca.empty()) {
        options.set_cert_request_type(GRPC_SSL_DONT_REQUEST_CLIENT_CERTIFICATE);
    } else {
        options.watch_root_certs();
        options.set_cert_request_type(GRPC_SSL_REQUEST_AND_REQUIRE_CLIENT_CERTIFICATE_AND_VERIFY);
    }
    return TlsServerCredentials(options);
}

std::shared_ptr<grpc::ServerCredentials> MakeCredentials(const ServerOptions& server) {
    const TlsPems& tls = server.tls;
    if (!tls.enabled()) {
        return grpc::InsecureServerCredentials();
    }
    if (!server.tls_files.cert.empty()) {
        return MakeRenewedCredentials(server);
    }
    grpc::SslServerCredentialsOptions options(
        tls.ca.empty() ? GRPC_SSL_DONT_REQUEST_CLIENT_CERTIFICATE
                       : GRPC_SSL_REQUEST_AND_REQUIRE_CLIENT_CERTIFICATE_AND_VERIFY);
    options.pem_root_certs = tls.ca;
    options.pem_key_cert_pairs.push_back({tls.key, tls.cert});
    return grpc::SslServerCredentials(options);
}

}  // namespace

Server::Server(const ServerOptions& options)
    : address_(options.listen),
      access_(!options.tls.ca.empty(), options.join_token,
              options.coordinator.quotas.client_streams),
      metrics_address_(options.metrics),
      coordinator_(options.coordinator) {
    if (metrics_address_) {
        metrics_ = std::make_unique<metrics::Endpoint>(ToString(*metrics_address_),
                                                       [this] { return coordinator_.AskStatus(); });
        metrics_address_->port = metrics_->port();
        spdlog::info("metrics on http://{}/metrics", ToString(*metrics_address_));
    }
    grpc::EnableDefaultHealthCheckService(true);
    grpc::reflection::InitProtoReflectionServerBuilderPlugin();
    grpc::ServerBuilder builder;
    builder.SetMaxReceiveMessageSize(kMaxMessage);
    builder.AddChannelArgument(GRPC_ARG_ALLOW_REUSEPORT, 0);
    builder.AddChannelArgument(GRPC_ARG_KEEPALIVE_TIME_MS, 20'000);
    builder.AddChannelArgument(GRPC_ARG_KEEPALIVE_TIMEOUT_MS, 10'000);
    builder.AddChannelArgument(GRPC_ARG_KEEPALIVE_PERMIT_WITHOUT_CALLS, 1);
    builder.AddChannelArgument(GRPC_ARG_HTTP2_MAX_PINGS_WITHOUT_DATA, 0);
    builder.AddChannelArgument(GRPC_ARG_HTTP2_MIN_RECV_PING_INTERVAL_WITHOUT_DATA_MS, 5'000);
    builder.AddChannelArgument(GRPC_ARG_MAX_CONCURRENT_STREAMS, kMaxStreams);
    builder.AddListeningPort(ToString(options.listen), MakeCredentials(options), &address_.port);
    builder.RegisterService(&jobs_);
    builder.RegisterService(&blobs_);
    builder.RegisterService(&work_);
    server_ = builder.BuildAndStart();
    if (!server_ || address_.port == 0) {
        throw Error(
            ErrorCode::kUnavailable,
            fmt::format("can't listen on {}: is the port taken, the host this machine's? Choose "
                        "another --listen",
                        ToString(options.listen)));
    }
    auto* health = server_->GetHealthCheckService();
    for (const char* service : {"JobService", "BlobService", "WorkerService"}) {
        health->SetServingStatus(std::string("relume.v1.") + service, true);
    }
}

Server::~Server() {
    if (!server_) {
        return;
    }
    server_->GetHealthCheckService()->Shutdown();
    // Its HTTP server takes two seconds to end.
    const auto closing = std::async(std::launch::async, [this] { metrics_.reset(); });
    coordinator_.control().Post([this] { coordinator_.StopStreams(); });
    const auto give_up = std::chrono::steady_clock::now() + kDrainTime;
    for (std::size_t workers = 1; workers > 0 && std::chrono::steady_clock::now() < give_up;) {
        std::promise<std::size_t> count;
        coordinator_.control().Post([&] { count.set_value(coordinator_.worker_stream_count()); });
        workers = count.get_future().get();
        if (workers > 0) {
            std::this_thread::sleep_for(kDrainInterval);
        }
    }
    const auto saved = std::make_shared<std::promise<void>>();
    coordinator_.control().Post(
        [this, saved] { coordinator_.SaveFilms([saved] { saved->set_value(); }); });
    if (saved->get_future().wait_for(kSaveTime) != std::future_status::ready) {
        spdlog::warn(
            "films are not saved within {} s: what came in since the last saves will be "
            "rendered again",
            kSaveTime.count());
    }
    server_->Shutdown(std::chrono::system_clock::now() + kGoodbyeTime);
    server_->Wait();
}

}  // namespace relume::server
