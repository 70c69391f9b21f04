#include "core/trust/tls_probe.h"

#include <arpa/inet.h>
#include <fmt/format.h>
#include <netdb.h>
#include <openssl/bio.h>
#include <openssl/err.h>
#include <openssl/pem.h>
#include <openssl/ssl.h>
#include <openssl/x509v3.h>
#include <sys/socket.h>
#include <unistd.h>

#include <memory>

#include "core/trust/loopback.h"

namespace relume {
namespace {

constexpr timeval kPatience{3, 0};

struct Free {
    void operator()(BIO* bio) const { BIO_free(bio); }
    void operator()(SSL_CTX* context) const { SSL_CTX_free(context); }
    void operator()(SSL* ssl) const { SSL_free(ssl); }
    void operator()(X509_STORE_CTX* check) const { X509_STORE_CTX_free(check); }
    void operator()(X509* cert) const { X509_free(cert); }
    void operator()(EVP_PKEY* key) const { EVP_PKEY_free(key); }
    void operator()(addrinfo* list) const { freeaddrinfo(list); }
};
template <typename T>
using Owned = std::unique_ptr<T, Free>;

Owned<BIO> Reader(const std::string& bytes) {
    return Owned<BIO>(BIO_new_mem_buf(bytes.data(), static_cast<int>(bytes.size())));
}

class Socket {
  public:
    Socket(const std::string& host, const std::string& port) {
        addrinfo hints{}, *found = nullptr;
        hints.ai_socktype = SOCK_STREAM;
        hints.ai_flags = AI_NUMERICSERV;
        if (getaddrinfo(host.c_str(), port.c_str(), &hints, &found) != 0) {
            return;
        }
        const Owned<addrinfo> list(found);
        for (const addrinfo* at = found; at != nullptr && fd_ < 0; at = at->ai_next) {
            fd_ = socket(at->ai_family, at->ai_socktype | SOCK_CLOEXEC, at->ai_protocol);
            // On Linux the time to send limits connect, too.
            if (fd_ >= 0 &&
                (setsockopt(fd_, SOL_SOCKET, SO_RCVTIMEO, &kPatience, sizeof kPatience) != 0 ||
                 setsockopt(fd_, SOL_SOCKET, SO_SNDTIMEO, &kPatience, sizeof kPatience) != 0 ||
                 connect(fd_, at->ai_addr, at->ai_addrlen) != 0)) {
                close(fd_);
                fd_ = -1;
            }
        }
    }
    ~Socket() {
        if (fd_ >= 0) {
            close(fd_);
        }
    }
    Socket(const Socket&) = delete;
    Socket& operator=(const Socket&) = delete;

    int fd() const { return fd_; }  // < 0: out of reach

  private:
    int fd_ = -1;
};

void UsePems(SSL_CTX* context, const TlsPems& pems) {
    if (!pems.ca.empty()) {
        SSL_CTX_set_verify(context, SSL_VERIFY_PEER, nullptr);
        const auto in = Reader(pems.ca);
        while (const Owned<X509> ca{PEM_read_bio_X509(in.get(), nullptr, nullptr, nullptr)}) {
            X509_STORE_add_cert(SSL_CTX_get_cert_store(context), ca.get());
        }
    }
    if (!pems.cert.empty()) {
        const auto in = Reader(pems.cert);
        if (const Owned<X509> own{PEM_read_bio_X509(in.get(), nullptr, nullptr, nullptr)}) {
            SSL_CTX_use_certificate(context, own.get());
        }
        while (const Owned<X509> issuer{PEM_read_bio_X509(in.get(), nullptr, nullptr, nullptr)}) {
            SSL_CTX_add1_chain_cert(context, issuer.get());
        }
        const Owned<EVP_PKEY> key{
            PEM_read_bio_PrivateKey(Reader(pems.key).get(), nullptr, nullptr, nullptr)};
        SSL_CTX_use_PrivateKey(context, key.get());
    }
    ERR_clear_error();
}

void ExpectHost(SSL* ssl, const std::string& host) {
    in6_addr address{};
    if (inet_pton(AF_INET, host.c_str(), &address) == 1 ||
        inet_pton(AF_INET6, host.c_str(), &address) == 1) {
        X509_VERIFY_PARAM_set1_ip_asc(SSL_get0_param(ssl), host.c_str());
    } else {
        SSL_set_tlsext_host_name(ssl, host.c_str());
        SSL_set1_host(ssl, host.c_str());
    }
}

// Why we don't believe the server's certificate.
std::string Distrust(long result, const std::string& host) {
    const std::string why = X509_verify_cert_error_string(result);
    switch (result) {
        case X509_V_ERR_HOSTNAME_MISMATCH:
        case X509_V_ERR_IP_ADDRESS_MISMATCH:
            return fmt::format(
                "the server's certificate is not for '{}'; reach it by a name of its certificate, "
                "or make one with this name: deploy/certs FOLDER --name {} server",
                host, host);
        case X509_V_ERR_CERT_HAS_EXPIRED:
        case X509_V_ERR_CERT_NOT_YET_VALID:
            return fmt::format(
                "the server's certificate is not valid at this time ({}); renew it (deploy/certs) "
                "and restart the server, or check the clocks",
                why);
        default:
            return fmt::format(
                "the server's certificate is not believed ({}); give the CA that made it by "
                "--tls-ca",
                why);
    }
}

// Why we would not let our own certificate in, X509_V_OK if we would.
int VerifyOurs(SSL_CTX* context) {
    const Owned<X509_STORE_CTX> check(X509_STORE_CTX_new());
    STACK_OF(X509)* issuers = nullptr;
    SSL_CTX_get0_chain_certs(context, &issuers);
    if (!check ||
        X509_STORE_CTX_init(check.get(), SSL_CTX_get_cert_store(context),
                            SSL_CTX_get0_certificate(context), issuers) != 1 ||
        X509_STORE_CTX_set_purpose(check.get(), X509_PURPOSE_SSL_CLIENT) != 1) {
        return X509_V_ERR_UNSPECIFIED;
    }
    X509_verify_cert(check.get());
    return X509_STORE_CTX_get_error(check.get());
}

// Why the server, which asked for a certificate, broke off. gRPC's servers send no alert that would
// tell, so we look at our certificate as the server must have.
std::string Refusal(SSL_CTX* context) {
    constexpr const char* kRemedy =
        "give one of the server's CA by --tls-cert and --tls-key (deploy/certs makes them)";
    if (SSL_CTX_get0_certificate(context) == nullptr) {
        return fmt::format("the server asks for a certificate; {}", kRemedy);
    }
    const char* why = "it is of another CA than that of --tls-ca";
    switch (VerifyOurs(context)) {
        case X509_V_OK:
            why = "it may be of another CA than the server's --tls-ca, or a clock may be wrong";
            break;
        case X509_V_ERR_CERT_HAS_EXPIRED:
        case X509_V_ERR_CERT_NOT_YET_VALID:
            why = "it is not valid at this time";
            break;
        case X509_V_ERR_INVALID_PURPOSE:
            why = "it is not made for clients";
            break;
        default:
            break;
    }
    return fmt::format("the server refuses our certificate: {}; {}", why, kRemedy);
}

}  // namespace

std::string ProbeTls(const std::string& server, const TlsPems& pems) {
    const auto [host, port] = SplitHostPort(server);
    const Socket socket(host, port);
    const Owned<SSL_CTX> context(SSL_CTX_new(TLS_client_method()));
    if (host.empty() || socket.fd() < 0 || !context) {
        return "";
    }
    SSL_CTX_set_min_proto_version(context.get(), TLS1_2_VERSION);
    UsePems(context.get(), pems);
    const Owned<SSL> ssl(SSL_new(context.get()));
    constexpr unsigned char kHttp2[] = {2, 'h', '2'};
    SSL_set_alpn_protos(ssl.get(), kHttp2, sizeof kHttp2);
    ExpectHost(ssl.get(), host);
    SSL_set_fd(ssl.get(), socket.fd());

    bool asked = false;  // for a certificate
    SSL_set_cert_cb(
        ssl.get(),
        [](SSL*, void* flag) {
            *static_cast<bool*>(flag) = true;
            return 1;
        },
        &asked);

    ERR_clear_error();
    const int connected = SSL_connect(ssl.get());
    // A TLS 1.3 server looks at our certificate after its side of the handshake: the first word of
    // HTTP/2 says that it is content.
    char byte = 0;
    const int result = connected == 1 ? SSL_read(ssl.get(), &byte, 1) : connected;
    const int kind = SSL_get_error(ssl.get(), result);
    const bool waits = kind == SSL_ERROR_WANT_READ || kind == SSL_ERROR_WANT_WRITE;
    // A proxy whose server is down, say: nobody has answered at all.
    const bool closed = ERR_GET_REASON(ERR_peek_last_error()) == SSL_R_UNEXPECTED_EOF_WHILE_READING;
    ERR_clear_error();

    if (!pems.enabled()) {
        return connected == 1 || asked
                   ? "the server speaks TLS; give the CA of its certificate by --tls-ca and, if it "
                     "asks for them, --tls-cert and --tls-key"
                   : "";
    }
    if (result == 1 || waits) {
        return "";
    }
    if (connected != 1 && SSL_get_verify_result(ssl.get()) != X509_V_OK) {
        return Distrust(SSL_get_verify_result(ssl.get()), host);
    }
    if (asked) {
        return Refusal(context.get());
    }
    if (connected != 1 && kind == SSL_ERROR_SSL && !closed) {
        return "the server does not speak TLS; start it with --tls-cert and --tls-key, or leave "
               "out --tls-ca, --tls-cert and --tls-key (RELUME_TLS_CA, ...)";
    }
    return "";
}

}  // namespace relume
