#pragma once

#include <gtest/gtest.h>

#include <cstdlib>
#include <filesystem>
#include <string>

#include "core/base/files.h"
#include "core/trust/tls_files.h"

namespace relume {

// Certificates of a CA of their own, made by deploy/certs: server, worker, client, operator and
// admin, each in the subfolder of its name, or the server's and `others`, "client=alice ...".
class TestCerts {
  public:
    explicit TestCerts(const std::string& others = "") {
        Run("'" RELUME_SOURCE_DIR "/deploy/certs' '" + folder_.path().string() + "' " +
            (others.empty() ? "" : "server " + others));
    }

    std::string Path(const std::string& subfolder, const std::string& file) const {
        return (folder_.path() / subfolder / file).string();
    }
    TlsFiles Files(const std::string& subfolder) const {
        return {Path(subfolder, "cert.pem"), Path(subfolder, "key.pem"), Path(subfolder, "ca.pem")};
    }
    TlsPems Pems(const std::string& subfolder) const {
        const TlsFiles files = Files(subfolder);
        return {ReadFile(files.cert), ReadFile(files.key), ReadFile(files.ca)};
    }
    // Makes a copy of a subfolder whose certificate expired yesterday.
    void MakeExpired(const std::string& from, const std::string& to) const {
        std::filesystem::copy(folder_.path() / from, folder_.path() / to);
        Run("openssl x509 -x509toreq -in '" + Path(from, "cert.pem") + "' -signkey '" +
            Path(from, "key.pem") + "' -copy_extensions copyall -out '" + Path(to, "request.pem") +
            "' && openssl x509 -req -copy_extensions copyall -in '" + Path(to, "request.pem") +
            "' -CA '" + Path("ca", "ca.pem") + "' -CAkey '" + Path("ca", "key.pem") +
            "' -days -1 -out '" + Path(to, "cert.pem") + "'");
    }

  private:
    static void Run(const std::string& command) {
        EXPECT_EQ(std::system(("{ " + command + "; } >/dev/null 2>&1").c_str()), 0) << command;
    }

    TemporaryFolder folder_;
};

}  // namespace relume
