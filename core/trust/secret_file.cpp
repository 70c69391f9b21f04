#include "core/trust/secret_file.h"

#include <fmt/format.h>
#include <sys/stat.h>

#include "core/base/error.h"
#include "core/base/files.h"

namespace relume {

std::string ReadNamedFile(const std::string& option, const std::string& path) {
    try {
        return ReadFile(path);
    } catch (const Error& error) {
        ThrowInvalidArgument(fmt::format("{} {}", option, error.what()));
    }
}

std::string ReadSecretFile(const std::string& option, const std::string& path) {
    std::string bytes = ReadNamedFile(option, path);
    struct stat status {};
    if (stat(path.c_str(), &status) == 0 && S_ISREG(status.st_mode) &&
        (status.st_mode & S_IROTH) != 0) {
        ThrowInvalidArgument(
            fmt::format("{} {}: everybody on this machine may read this secret; chmod 600 it (or "
                        "640, for its group)",
                        option, path));
    }
    return bytes;
}

}  // namespace relume
