#include "proto/channel/credentials.h"

#include "core/trust/tls_probe.h"
#include "proto/codec/status.h"

namespace relume::channel {

std::shared_ptr<grpc::ChannelCredentials> MakeCredentials(const TlsPems& pems) {
    if (!pems.enabled()) {
        return grpc::InsecureChannelCredentials();
    }
    return grpc::SslCredentials({pems.ca, pems.key, pems.cert});
}

Error ExplainStatus(const grpc::Status& status, const std::string& server, const TlsPems& pems) {
    if (status.error_code() == grpc::StatusCode::UNAVAILABLE) {
        if (const std::string why = ProbeTls(server, pems); !why.empty()) {
            return {ErrorCode::kUnauthenticated, server + ": " + why};
        }
    }
    return codec::FromStatus(status, server);
}

}  // namespace relume::channel
