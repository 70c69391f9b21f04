#pragma once

#include <grpcpp/server.h>

#include <memory>
#include <optional>
#include <string>

#include "core/trust/tls_files.h"
#include "server/metrics/endpoint.h"
#include "server/rpc/access.h"
#include "server/rpc/blob_service.h"
#include "server/rpc/coordinator.h"
#include "server/rpc/job_service.h"
#include "server/rpc/listen_address.h"
#include "server/rpc/work_service.h"

namespace relume::server {

struct ServerOptions {
    ListenAddress listen{"127.0.0.1", 0};
    TlsPems tls;  // with a CA: callers need certificates, which tell their roles
    // Where `tls` came from: looked at again every so many seconds, so that renewed certificates
    // count for new connections. Not named: never.
    TlsFiles tls_files;
    int tls_refresh_seconds = 10;
    std::string join_token;  // that workers must show; "": none
    CoordinatorOptions coordinator;
    std::optional<ListenAddress> metrics;  // for Prometheus, by HTTP; none: nowhere
};

// A coordinator that listens: its services, health and reflection.
class Server {
  public:
    // Serves when it returns. Throws kUnavailable if it can't listen there.
    explicit Server(const ServerOptions& options);
    // Asks the workers to finish and leave, says NOT_SERVING, saves films of jobs under way, and
    // ends all calls, in two seconds, six more at most for the films.
    ~Server();

    // With the port that was chosen.
    const ListenAddress& address() const { return address_; }
    const std::optional<ListenAddress>& metrics_address() const { return metrics_address_; }

  private:
    ListenAddress address_;
    const Access access_;
    std::optional<ListenAddress> metrics_address_;
    Coordinator coordinator_;
    JobService jobs_{&coordinator_, &access_};
    BlobService blobs_{&coordinator_, &access_};
    WorkService work_{&coordinator_, &access_};
    std::unique_ptr<metrics::Endpoint> metrics_;
    std::unique_ptr<grpc::Server> server_;
};

}  // namespace relume::server
