#pragma once

#include <string>
#include <utility>

namespace relume {

// True for "localhost" and addresses of loopback, without brackets: only this machine is behind it.
bool IsLoopbackHost(const std::string& host);

// "HOST:PORT" or "[V6]:PORT" in its parts, the host without brackets; two empty strings if
// `address` is neither.
std::pair<std::string, std::string> SplitHostPort(const std::string& address);

}  // namespace relume
