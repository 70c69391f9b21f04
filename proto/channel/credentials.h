#pragma once

#include <grpcpp/security/credentials.h>
#include <grpcpp/support/status.h>

#include <memory>
#include <string>

#include "core/base/error.h"
#include "core/trust/tls_files.h"

namespace relume::channel {

// Of whoever calls a server: TLS if `pems` hold anything, with our certificate if they hold one.
std::shared_ptr<grpc::ChannelCredentials> MakeCredentials(const TlsPems& pems);

// Of a caller that lives long: the same from `files`, which gRPC looks at again every so many
// seconds. What they hold then counts for new connections; what can't be read, or does not fit, is
// passed over. Nothing is named in `files`: no TLS.
std::shared_ptr<grpc::ChannelCredentials> MakeRenewedCredentials(const TlsFiles& files,
                                                                 int refresh_seconds);

// As codec::FromStatus; a server that can't be reached is looked at once more, and if TLS is why, a
// kUnauthenticated says what is wrong with it (see ProbeTls, which takes some seconds at worst).
Error ExplainStatus(const grpc::Status& status, const std::string& server, const TlsPems& pems);

}  // namespace relume::channel
