#pragma once

#include <grpcpp/support/status.h>

#include <functional>

#include "core/base/error.h"

namespace relume::server {

// The one border between Errors and gRPC. The status carries a google.rpc.Status with a
// relume.v1.ErrorDetail (reason: the error's kind) as binary detail, and its message in one line.
grpc::Status ToStatus(const Error& error);

// Runs `body` and tells how it went: OK, the status of the Error that it threw, or INTERNAL for
// anything else.
grpc::Status Guard(const std::function<void()>& body);

}  // namespace relume::server
