#include "client/lib/output_file.h"

#include <fcntl.h>
#include <fmt/format.h>
#include <sys/stat.h>
#include <unistd.h>

#include <cerrno>
#include <cstdlib>
#include <cstring>
#include <filesystem>
#include <utility>
#include <vector>

namespace relume::client {
namespace fs = std::filesystem;
namespace {

[[noreturn]] void ThrowOutputError(const std::string& path, int error) {
    const bool full = error == ENOSPC || error == EDQUOT || error == EFBIG;
    throw OutputError(
        full ? ErrorCode::kResourceExhausted : ErrorCode::kFailedPrecondition,
        fmt::format("{}: can't be written: {}; {}", path, std::strerror(error),
                    full ? "free some space or choose another folder" : "choose another place"));
}

// 0, or the errno of what went wrong.
int WriteAll(int fd, std::string_view bytes) {
    while (!bytes.empty()) {
        const ssize_t n = write(fd, bytes.data(), bytes.size());
        if (n >= 0) {
            bytes.remove_prefix(static_cast<std::size_t>(n));
        } else if (errno != EINTR) {
            return errno;
        }
    }
    return 0;
}

}  // namespace

void CheckOutput(const std::string& path) {
    const fs::path folder = fs::path(path).has_parent_path() ? fs::path(path).parent_path() : ".";
    std::error_code ignored;
    if (path.empty() || fs::is_directory(path, ignored)) {
        ThrowOutputError(path, EISDIR);
    }
    if (!fs::is_directory(folder, ignored)) {
        throw OutputError(
            ErrorCode::kFailedPrecondition,
            fmt::format("{}: the folder {} is not there; make it first", path, folder.string()));
    }
    const OutputFile probe(path);
}

OutputFile::OutputFile(std::string path) : path_(std::move(path)) {
    std::error_code ignored;
    // A link that leads nowhere yet is followed as far as it goes.
    target_ =
        fs::is_symlink(path_, ignored) ? fs::weakly_canonical(path_, ignored).string() : path_;
    device_ = fs::exists(target_, ignored) && !fs::is_regular_file(target_, ignored);
    temporary_ = (device_ ? (fs::temp_directory_path() / "relume").string() : target_) + ".XXXXXX";
    fd_ = mkostemp(temporary_.data(), O_CLOEXEC);
    if (fd_ < 0) {
        ThrowOutputError(path_, errno);
    }
}

OutputFile::~OutputFile() {
    if (fd_ >= 0) {
        close(fd_);
        unlink(temporary_.c_str());
    }
}

void OutputFile::Append(std::string_view bytes) {
    if (const int error = WriteAll(fd_, bytes); error != 0) {
        ThrowOutputError(path_, error);
    }
    size_ += bytes.size();
}

void OutputFile::CopyToDevice() {
    const int device = open(target_.c_str(), O_WRONLY | O_CLOEXEC);
    int error = device < 0 ? errno : 0;
    std::vector<char> buffer(std::size_t{1} << 16);
    for (off_t offset = 0; error == 0;) {
        const ssize_t n = pread(fd_, buffer.data(), buffer.size(), offset);
        if (n == 0) {
            break;
        }
        error = n < 0 ? errno : WriteAll(device, {buffer.data(), static_cast<std::size_t>(n)});
        offset += n;
    }
    if (device >= 0 && close(device) != 0 && error == 0) {
        error = errno;
    }
    if (error != 0) {
        ThrowOutputError(path_, error);
    }
}

void OutputFile::Commit() {
    if (device_) {
        CopyToDevice();
        unlink(temporary_.c_str());
    } else {
        const mode_t mask = umask(0);
        umask(mask);
        if (fchmod(fd_, 0666 & ~mask) != 0 || fsync(fd_) != 0 ||
            rename(temporary_.c_str(), target_.c_str()) != 0) {
            ThrowOutputError(path_, errno);
        }
    }
    close(std::exchange(fd_, -1));
}

}  // namespace relume::client
