#include "server/store/data_folder.h"

#include <fcntl.h>
#include <fmt/format.h>
#include <sys/file.h>
#include <unistd.h>

#include <cerrno>
#include <cstring>
#include <system_error>

#include "core/base/error.h"

namespace relume::store {

void ThrowFileError(const std::filesystem::path& path, const char* doing, int error) {
    const bool full = error == ENOSPC || error == EDQUOT;
    throw Error(
        full ? ErrorCode::kResourceExhausted : ErrorCode::kFailedPrecondition,
        fmt::format("{}: can't {}: {}; {}", path.string(), doing, std::strerror(error),
                    full ? "free some space on the server" : "check the server's --data folder"));
}

void MakeFolder(const std::filesystem::path& path) {
    std::error_code error;
    std::filesystem::create_directories(path, error);
    if (error || !std::filesystem::is_directory(path)) {
        ThrowFileError(path, "make this folder", error ? error.value() : ENOTDIR);
    }
}

DataFolder::DataFolder(const std::filesystem::path& path) : path_(path) {
    MakeFolder(path);
    const auto file = path / "lock";
    lock_ = open(file.c_str(), O_CREAT | O_RDWR | O_CLOEXEC, 0644);
    if (lock_ < 0) {
        ThrowFileError(file, "write", errno);
    }
    if (flock(lock_, LOCK_EX | LOCK_NB) != 0) {
        close(lock_);
        throw Error(
            ErrorCode::kFailedPrecondition,
            fmt::format("{}: another server uses this folder; stop it or choose another --data",
                        path.string()));
    }
}

DataFolder::~DataFolder() { close(lock_); }

}  // namespace relume::store
