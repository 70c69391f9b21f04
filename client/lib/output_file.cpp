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

namespace relume::client {
namespace fs = std::filesystem;
namespace {

[[noreturn]] void ThrowOutputError(const std::string& path, int error) {
    const bool full = error == ENOSPC || error == EDQUOT;
    throw OutputError(
        full ? ErrorCode::kResourceExhausted : ErrorCode::kFailedPrecondition,
        fmt::format("{}: can't be written: {}; {}", path, std::strerror(error),
                    full ? "free some space or choose another folder" : "choose another place"));
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

OutputFile::OutputFile(std::string path) : path_(std::move(path)), temporary_(path_ + ".XXXXXX") {
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
    while (!bytes.empty()) {
        const ssize_t n = write(fd_, bytes.data(), bytes.size());
        if (n >= 0) {
            bytes.remove_prefix(static_cast<std::size_t>(n));
            size_ += static_cast<std::uint64_t>(n);
        } else if (errno != EINTR) {
            ThrowOutputError(path_, errno);
        }
    }
}

void OutputFile::Commit() {
    const mode_t mask = umask(0);
    umask(mask);
    if (fchmod(fd_, 0666 & ~mask) != 0 || fsync(fd_) != 0 ||
        rename(temporary_.c_str(), path_.c_str()) != 0) {
        ThrowOutputError(path_, errno);
    }
    close(std::exchange(fd_, -1));
}

}  // namespace relume::client
