#include "core/trust/tls_files.h"

#include <fmt/format.h>
#include <openssl/bio.h>
#include <openssl/err.h>
#include <openssl/pem.h>
#include <openssl/x509.h>

#include <memory>
#include <vector>

#include "core/base/error.h"
#include "core/trust/secret_file.h"

namespace relume {
namespace {

constexpr const char* kRemedy = "deploy/certs makes good ones";

struct Free {
    void operator()(BIO* bio) const { BIO_free(bio); }
    void operator()(X509* cert) const { X509_free(cert); }
    void operator()(EVP_PKEY* key) const { EVP_PKEY_free(key); }
};
using Bio = std::unique_ptr<BIO, Free>;
using Certificate = std::unique_ptr<X509, Free>;
using Key = std::unique_ptr<EVP_PKEY, Free>;

Bio Reader(const std::string& bytes) {
    return Bio(BIO_new_mem_buf(bytes.data(), static_cast<int>(bytes.size())));
}

std::string Print(const ASN1_TIME* time) {
    const Bio out(BIO_new(BIO_s_mem()));
    ASN1_TIME_print(out.get(), time);
    char* text = nullptr;
    const long size = BIO_get_mem_data(out.get(), &text);
    return {text, static_cast<std::size_t>(size)};
}

std::vector<Certificate> ReadCertificates(const char* option, const std::string& path,
                                          const std::string& bytes) {
    std::vector<Certificate> certificates;
    const Bio in = Reader(bytes);
    while (X509* next = PEM_read_bio_X509(in.get(), nullptr, nullptr, nullptr)) {
        certificates.emplace_back(next);
    }
    ERR_clear_error();
    if (certificates.empty()) {
        ThrowInvalidArgument(
            fmt::format("{} {}: holds no certificate in PEM form; {}", option, path, kRemedy));
    }
    return certificates;
}

// "", or what is wrong with its time.
std::string Untimely(const X509* certificate) {
    const ASN1_TIME* from = X509_get0_notBefore(certificate);
    const ASN1_TIME* until = X509_get0_notAfter(certificate);
    if (X509_cmp_current_time(until) <= 0) {
        return fmt::format("has expired on {}", Print(until));
    }
    if (X509_cmp_current_time(from) > 0) {
        return fmt::format("is not valid before {}; check this machine's clock", Print(from));
    }
    return "";
}

void CheckIdentity(const TlsFiles& files, const TlsPems& pems) {
    const auto certificates = ReadCertificates("--tls-cert", files.cert, pems.cert);
    if (const std::string wrong = Untimely(certificates.front().get()); !wrong.empty()) {
        ThrowInvalidArgument(
            fmt::format("--tls-cert {}: the certificate {}; {}", files.cert, wrong, kRemedy));
    }
    // Answers with no password, lest OpenSSL asks for one on the terminal.
    const auto no_password = [](char*, int, int, void*) { return -1; };
    const Key key(PEM_read_bio_PrivateKey(Reader(pems.key).get(), nullptr, no_password, nullptr));
    ERR_clear_error();
    if (!key) {
        ThrowInvalidArgument(
            fmt::format("--tls-key {}: holds no private key in PEM form without a password; {}",
                        files.key, kRemedy));
    }
    const bool fits = X509_check_private_key(certificates.front().get(), key.get()) == 1;
    ERR_clear_error();
    if (!fits) {
        ThrowInvalidArgument(fmt::format("--tls-key {}: is not the key of --tls-cert {}; {}",
                                         files.key, files.cert, kRemedy));
    }
}

// One that is timely is enough: bundles hold old ones, too.
void CheckCa(const TlsFiles& files, const TlsPems& pems) {
    std::string wrong;
    for (const auto& certificate : ReadCertificates("--tls-ca", files.ca, pems.ca)) {
        const std::string untimely = Untimely(certificate.get());
        if (untimely.empty()) {
            return;
        }
        wrong = wrong.empty() ? untimely : wrong;
    }
    ThrowInvalidArgument(
        fmt::format("--tls-ca {}: the certificate {}; {}", files.ca, wrong, kRemedy));
}

TlsPems Load(const TlsFiles& files) {
    if (files.cert.empty() != files.key.empty()) {
        ThrowInvalidArgument(files.cert.empty() ? "--tls-key: needs --tls-cert, too"
                                                : "--tls-cert: needs --tls-key, too");
    }
    TlsPems pems;
    if (!files.cert.empty()) {
        pems.cert = ReadNamedFile("--tls-cert", files.cert);
        pems.key = ReadSecretFile("--tls-key", files.key);
        CheckIdentity(files, pems);
    }
    if (!files.ca.empty()) {
        pems.ca = ReadNamedFile("--tls-ca", files.ca);
        CheckCa(files, pems);
    }
    return pems;
}

}  // namespace

TlsPems LoadServerTls(const TlsFiles& files) {
    if (!files.ca.empty() && files.cert.empty()) {
        ThrowInvalidArgument(
            "--tls-ca: a server needs --tls-cert and --tls-key, too, its own certificate");
    }
    return Load(files);
}

TlsPems LoadClientTls(const TlsFiles& files) {
    if (files.ca.empty() && !(files.cert.empty() && files.key.empty())) {
        ThrowInvalidArgument(
            "--tls-cert and --tls-key: need --tls-ca, too, by which the server is believed");
    }
    return Load(files);
}

}  // namespace relume
