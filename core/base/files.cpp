#include "core/base/files.h"

#include <fcntl.h>
#include <fmt/format.h>
#include <stdlib.h>
#include <sys/stat.h>
#include <unistd.h>

#include <cerrno>
#include <cstring>

#include "core/base/error.h"

namespace relume {
namespace {

[[noreturn]] void ThrowWriteError(const std::filesystem::path& path, int error) {
    const auto code = error == ENOSPC || error == EDQUOT ? ErrorCode::kResourceExhausted
                                                         : ErrorCode::kFailedPrecondition;
    throw Error(code, fmt::format("{}: can't write: {}; free some space or choose another place",
                                  path.string(), std::strerror(error)));
}

// 0, or the errno of what failed.
int WriteAll(int fd, std::string_view bytes) {
    while (!bytes.empty()) {
        const ssize_t n = write(fd, bytes.data(), bytes.size());
        if (n > 0) {
            bytes.remove_prefix(static_cast<std::size_t>(n));
        } else if (n < 0 && errno != EINTR) {
            return errno;
        }
    }
    return 0;
}

// A device or pipe (/dev/stdout, /dev/null) is written to, never replaced by a file.
void WriteToDevice(const std::filesystem::path& path, std::string_view bytes) {
    const int fd = open(path.c_str(), O_WRONLY | O_CLOEXEC);
    if (fd < 0) {
        ThrowWriteError(path, errno);
    }
    int error = WriteAll(fd, bytes);
    if (close(fd) != 0 && error == 0) {
        error = errno;
    }
    if (error != 0) {
        ThrowWriteError(path, error);
    }
}

}  // namespace

std::string ReadFile(const std::filesystem::path& path) {
    std::error_code ignored;
    if (std::filesystem::is_directory(path, ignored)) {
        ThrowInvalidArgument(path.string() + ": is a folder, a file is needed");
    }
    const int fd = open(path.c_str(), O_RDONLY | O_CLOEXEC);
    if (fd < 0) {
        ThrowNotFound(
            fmt::format("{}: can't open: {}; check the path", path.string(), std::strerror(errno)));
    }
    // Pipes and /proc have no size to go by: read on until nothing comes.
    struct stat status {};
    std::string bytes(fstat(fd, &status) == 0 ? static_cast<std::size_t>(status.st_size) + 1 : 1,
                      '\0');
    std::size_t done = 0;
    int error = 0;
    for (;;) {
        const ssize_t n = read(fd, bytes.data() + done, bytes.size() - done);
        if (n > 0) {
            done += static_cast<std::size_t>(n);
            bytes.resize(done == bytes.size() ? 2 * done + 4096 : bytes.size());
        } else if (n == 0 || errno != EINTR) {
            error = n == 0 ? 0 : errno;
            break;
        }
    }
    close(fd);
    if (error != 0) {
        throw Error(ErrorCode::kDataLoss, fmt::format("{}: reading failed: {}; check the disk",
                                                      path.string(), std::strerror(error)));
    }
    bytes.resize(done);
    return bytes;
}

void WriteFileAtomically(const std::filesystem::path& link, std::string_view bytes) {
    // What a link leads to is replaced, the link stays.
    std::error_code dangling, ignored;
    const auto target = std::filesystem::canonical(link, dangling);
    const auto& path = dangling ? link : target;
    const auto status = std::filesystem::status(path, ignored);
    if (std::filesystem::is_other(status)) {
        WriteToDevice(path, bytes);
        return;
    }
    std::string name = path.string() + ".XXXXXX";
    const int fd = mkostemp(name.data(), O_CLOEXEC);
    if (fd < 0) {
        ThrowWriteError(path, errno);
    }
    int error = WriteAll(fd, bytes);
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
