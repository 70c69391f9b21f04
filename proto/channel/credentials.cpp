#include "proto/channel/credentials.h"

#include <grpcpp/security/tls_certificate_provider.h>
#include <grpcpp/security/tls_credentials_options.h>

#include "core/trust/tls_probe.h"
#include "proto/codec/status.h"

namespace relume::channel {

std::shared_ptr<grpc::ChannelCredentials> MakeCredentials(const TlsPems& pems) {
    if (!pems.enabled()) {
        return grpc::InsecureChannelCredentials();
    }
    return grpc::SslCredentials({pems.ca, pems.key, pems.cert});
}

std::shared_ptr<grpc::ChannelCredentials> MakeRenewedCredentials(const TlsFiles& files,
                                                                 int refresh_seconds) {
    using namespace grpc::experimental;  // as it still is in 1.51
    if (files.ca.empty()) {
        return grpc::InsecureChannelCredentials();
    }
    TlsChannelCredentialsOptions options;
    options.set_certificate_provider(std::make_shared<FileWatcherCertificateProvider>(
        files.key, files.cert, files.ca, static_cast<unsigned>(refresh_seconds)));
    options.watch_root_certs();
    if (!files.cert.empty()) {
        options.watch_identity_key_cert_pairs();
    }
    return TlsCredentials(options);
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
