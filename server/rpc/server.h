#pragma once

#include <grpcpp/server.h>

#include <memory>
#include <string>

#include "core/trust/tls_files.h"
#include "server/rpc/access.h"
#include "server/rpc/blob_service.h"
#include "server/rpc/coordinator.h"
#include "server/rpc/job_service.h"
#include "server/rpc/listen_address.h"
#include "server/rpc/work_service.h"

namespace relume::server {

struct ServerOptions {
    ListenAddress listen{"127.0.0.1", 0};
    TlsPems tls;             // with a CA: callers need certificates, which tell their roles
    std::string join_token;  // that workers must show; "": none
    CoordinatorOptions coordinator;
};

// A coordinator that listens: its services, health and reflection.
class Server {
  public:
    // Serves when it returns. Throws kUnavailable if it can't listen there.
    explicit Server(const ServerOptions& options);
    // Asks the workers to finish and leave, says NOT_SERVING, and ends all calls, at the latest
    // after about two seconds.
    ~Server();

    // With the port that was chosen.
    const ListenAddress& address() const { return address_; }

  private:
    ListenAddress address_;
    const Access access_;
    Coordinator coordinator_;
    JobService jobs_{&coordinator_, &access_};
    BlobService blobs_{&coordinator_, &access_};
    WorkService work_{&coordinator_, &access_};
    std::unique_ptr<grpc::Server> server_;
};

}  // namespace relume::server
