#include "core/base/files.h"

#include <fcntl.h>
#include <fmt/format.h>
#include <stdlib.h>
#include <sys/stat.h>
#include <unistd.h>

#include <cerrno>
#include <cstring>
#include <fstream>
#include <sstream>

#include "core/base/error.h"

namespace relume {
namespace {

[[noreturn]] void ThrowWriteError(const std::filesystem::path& path, int error) {
    const auto code = error == ENOSPC || error == EDQUOT ? ErrorCode::kResourceExhausted
                                                         : ErrorCode::kFailedPrecondition;
    throw Error(code, fmt::format("{}: can't write: {}; free some space or choose another place",
                                  path.string(), std::strerror(error)));
}

}  // namespace

std::string ReadFile(const std::filesystem::path& path) {
    std::error_code ignored;
    if (std::filesystem::is_directory(path, ignored)) {
        ThrowInvalidArgument(path.string() + ": is a folder, a file is needed");
    }
    std::ifstream in(path, std::ios::binary);
    if (!in) {
        ThrowNotFound(
            fmt::format("{}: can't open: {}; check the path", path.string(), std::strerror(errno)));
    }
    std::ostringstream bytes;
    bytes << in.rdbuf();
    if (in.bad()) {
        throw Error(ErrorCode::kDataLoss, path.string() + ": reading failed");
    }
    return std::move(bytes).str();
}

void WriteFileAtomically(const std::filesystem::path& path, std::string_view bytes) {
    std::string name = path.string() + ".XXXXXX";
    const int fd = mkostemp(name.data(), O_CLOEXEC);
    if (fd < 0) {
        ThrowWriteError(path, errno);
    }
    int error = 0;
    for (std::size_t done = 0; done < bytes.size() && error == 0;) {
        const ssize_t n = write(fd, bytes.data() + done, bytes.size() - done);
        if (n > 0) {
            done += static_cast<std::size_t>(n);
        } else if (n < 0 && errno != EINTR) {
            error = errno;
        }
    }
    if (error == 0 && (fchmod(fd, 0644) != 0 || fsync(fd) != 0)) {
        error = errno;
    }
    if (close(fd) != 0 && error == 0) {
        error = errno;
    }
    if (error == 0 && rename(name.c_str(), path.c_str()) != 0) {
        error = errno;
    }
    if (error != 0) {
        unlink(name.c_str());
        ThrowWriteError(path, error);
    }
}

TemporaryFolder::TemporaryFolder(const std::filesystem::path& parent) {
    const auto base = parent.empty() ? std::filesystem::temp_directory_path() : parent;
    std::string name = (base / "relume-XXXXXX").string();
    if (mkdtemp(name.data()) == nullptr) {
        ThrowWriteError(base, errno);
    }
    path_ = name;
}

TemporaryFolder::~TemporaryFolder() {
    std::error_code ignored;
    std::filesystem::remove_all(path_, ignored);
}

}  // namespace relume
