#include "server/rpc/listen_address.h"

#include <arpa/inet.h>
#include <fmt/format.h>

#include <charconv>

#include "core/base/error.h"

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

bool IsLoopback(const ListenAddress& address) {
    if (address.host == "localhost") {
        return true;
    }
    in_addr v4{};
    if (inet_pton(AF_INET, address.host.c_str(), &v4) == 1) {
        return (ntohl(v4.s_addr) >> 24) == 127;
    }
    in6_addr v6{};
    return inet_pton(AF_INET6, address.host.c_str(), &v6) == 1 &&
           (IN6_IS_ADDR_LOOPBACK(&v6) || (IN6_IS_ADDR_V4MAPPED(&v6) && v6.s6_addr[12] == 127));
}

std::string ToString(const ListenAddress& address) {
    const bool v6 = address.host.find(':') != std::string::npos;
    return v6 ? fmt::format("[{}]:{}", address.host, address.port)
              : fmt::format("{}:{}", address.host, address.port);
}

}  // namespace relume::server
