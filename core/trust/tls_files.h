#pragma once

#include <string>

namespace relume {

// PEM files as named by --tls-cert, --tls-key and --tls-ca; "" where not given.
struct TlsFiles {
    std::string cert;  // of this process, its issuers after it
    std::string key;   // of that certificate, without a password
    std::string ca;    // whose certificates are believed
};

// What is in them.
struct TlsPems {
    std::string cert, key, ca;

    bool enabled() const { return !cert.empty() || !ca.empty(); }
};

// For a server: certificate and key, or neither; with a CA only clients with a certificate of its
// are let in. For who calls one: nothing, a CA, or all three. Throws kInvalidArgument, with option,
// file and remedy, if one is missing, can't be read, is no PEM of its kind, is not valid at this
// time, if the key is not the certificate's, or if others than its owner and group may read it.
TlsPems LoadServerTls(const TlsFiles& files);
TlsPems LoadClientTls(const TlsFiles& files);

}  // namespace relume
