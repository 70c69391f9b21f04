#include "client/lib/user_name.h"

#include <fmt/format.h>
#include <pwd.h>
#include <unistd.h>

#include <array>

namespace relume::client {

std::string UserAtHost() {
    constexpr std::size_t kMaxOwner = 64;
    std::string user = fmt::format("uid{}", geteuid());  // containers have users without a name
    passwd entry{};
    passwd* found = nullptr;
    std::array<char, 4096> buffer{};
    if (getpwuid_r(geteuid(), &entry, buffer.data(), buffer.size(), &found) == 0 &&
        found != nullptr) {
        user = found->pw_name;
    }
    std::array<char, 256> host{};
    if (gethostname(host.data(), host.size() - 1) != 0) {
        return user.substr(0, kMaxOwner);
    }
    return fmt::format("{}@{}", user, host.data()).substr(0, kMaxOwner);
}

}  // namespace relume::client
