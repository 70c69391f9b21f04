#pragma once

#include <string>

namespace relume {

// The metadata of a worker's stream that holds its join token.
inline constexpr const char* kJoinTokenKey = "relume-join-token";

// The secret in a file that workers show to be taken on: one line of 16 to 1024 printable
// characters without blanks; blanks and line ends around it don't count. Throws kInvalidArgument
// for anything else, and for a file that others than its owner and group may read. What is thrown
// never holds the secret.
std::string ReadJoinToken(const std::string& path);

// Takes the same time wherever they differ, and however long `given` is.
bool SameToken(const std::string& expected, const std::string& given);

}  // namespace relume
