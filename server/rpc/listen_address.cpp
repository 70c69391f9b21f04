#include "server/rpc/listen_address.h"

#include <fmt/format.h>

#include <charconv>

#include "core/base/error.h"
#include "core/trust/loopback.h"

namespace relume::server {

ListenAddress ParseListenAddress(const std::string& text) {
    ListenAddress address;
    const std::size_t colon = text.rfind(':');
    bool good = colon != std::string::npos && colon > 0;
    if (good) {
        address.host = text.substr(0, colon);
        if (address.host.front() == '[' && address.host.back() == ']') {
            address.host = address.host.substr(1, address.host.size() - 2);
        } else {
            good = address.host.find(':') == std::string::npos;
        }
        const char* begin = text.data() + colon + 1;
        const char* end = text.data() + text.size();
        const auto [last, error] = std::from_chars(begin, end, address.port);
        good = good && error == std::errc() && last == end && address.port >= 0 &&
               address.port <= 65535;
    }
    if (!good || address.host.empty()) {
        ThrowInvalidArgument(fmt::format(
            "'{}' is no address to listen on; give HOST:PORT, e.g. 127.0.0.1:7878", text));
    }
    return address;
}

bool IsLoopback(const ListenAddress& address) { return IsLoopbackHost(address.host); }

void CheckExposure(const ListenAddress& address, bool tls, bool insecure, bool join_token) {
    if (tls || IsLoopback(address)) {
        return;
    }
    if (!insecure) {
        ThrowInvalidArgument(
            fmt::format("--listen {}: others could reach it and nothing is encrypted; give "
                        "relume-server --tls-cert, --tls-key and --tls-ca (deploy/certs makes "
                        "them), or --insecure if the network is trusted",
                        ToString(address)));
    }
    if (join_token) {
        ThrowInvalidArgument(
            fmt::format("--join-token: would cross the network to {} in the clear; give "
                        "--tls-cert and --tls-key, too, or leave it out",
                        ToString(address)));
    }
}

std::string ToString(const ListenAddress& address) {
    const bool v6 = address.host.find(':') != std::string::npos;
    return v6 ? fmt::format("[{}]:{}", address.host, address.port)
              : fmt::format("{}:{}", address.host, address.port);
}

}  // namespace relume::server
