#pragma once

#include <string>

namespace relume::server {

// "HOST:PORT", "[::1]:7878". Throws kInvalidArgument for anything else.
struct ListenAddress {
    std::string host;  // without brackets
    int port = 0;      // 0: any free one
};
ListenAddress ParseListenAddress(const std::string& text);

// True if only this machine can reach it.
bool IsLoopback(const ListenAddress& address);

// Throws kInvalidArgument if others than this machine could reach the address and nothing would be
// encrypted, unless `insecure` says that this is meant; even so a join token would be no secret.
void CheckExposure(const ListenAddress& address, bool tls, bool insecure, bool join_token);

// "HOST:PORT", brackets added where needed.
std::string ToString(const ListenAddress& address);

}  // namespace relume::server
