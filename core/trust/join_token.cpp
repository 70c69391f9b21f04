#include "core/trust/join_token.h"

#include <fmt/format.h>
#include <openssl/crypto.h>

#include <algorithm>

#include "core/base/error.h"
#include "core/base/sha256.h"
#include "core/trust/secret_file.h"

namespace relume {
namespace {

constexpr std::size_t kLeast = 16, kMost = 1024;

}  // namespace

std::string ReadJoinToken(const std::string& path) {
    const std::string bytes = ReadSecretFile("--join-token", path);
    const std::size_t begin = bytes.find_first_not_of(" \t\r\n");
    const std::string token =
        begin == std::string::npos
            ? ""
            : bytes.substr(begin, bytes.find_last_not_of(" \t\r\n") + 1 - begin);
    const bool printable =
        std::all_of(token.begin(), token.end(), [](char c) { return c > ' ' && c <= '~'; });
    if (!printable || token.size() < kLeast || token.size() > kMost) {
        ThrowInvalidArgument(fmt::format(
            "--join-token {}: must hold one line of {} to {} printable characters without blanks; "
            "make one by `openssl rand -hex 32`",
            path, kLeast, kMost));
    }
    return token;
}

bool SameToken(const std::string& expected, const std::string& given) {
    const std::string a = Sha256Hex(expected), b = Sha256Hex(given);
    return CRYPTO_memcmp(a.data(), b.data(), a.size()) == 0;
}

}  // namespace relume
