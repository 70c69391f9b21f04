#pragma once

#include <grpcpp/support/status.h>

#include <string>

#include "core/base/error.h"

namespace relume::codec {

// The Error that a failed call stands for, with the same kind. `server` is HOST:PORT as the user
// gave it; a server that can't be reached is answered with what to do about it.
Error FromStatus(const grpc::Status& status, const std::string& server);

}  // namespace relume::codec
