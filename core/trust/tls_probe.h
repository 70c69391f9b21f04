#pragma once

#include <string>

#include "core/trust/tls_files.h"

namespace relume {

// Why TLS keeps the caller and `server` (HOST:PORT) apart, and what to do about it, for the message
// of a connection that failed: gRPC tells no more than that it broke. Connects once more, without
// gRPC and past any proxy, with `pems` or, if they are empty, to see whether TLS is spoken there.
// "" if TLS is not what is wrong or the server is out of reach; takes three seconds a step at most.
// SIGPIPE must be ignored.
std::string ProbeTls(const std::string& server, const TlsPems& pems);

}  // namespace relume
