#include "worker/loop/blob_cache.h"

#include <fcntl.h>
#include <fmt/format.h>
#include <sys/file.h>
#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <chrono>
#include <cstring>
#include <system_error>
#include <vector>

#include "core/base/error.h"
#include "core/base/files.h"
#include "core/base/log.h"
#include "core/base/sha256.h"

namespace relume::worker {
namespace fs = std::filesystem;
namespace {

constexpr std::chrono::hours kPartLife{24};  // of an unfinished transfer that nobody takes up

[[noreturn]] void ThrowDiskError(const fs::path& path, int error) {
    const bool full = error == ENOSPC || error == EDQUOT;
    throw Error(
        full ? ErrorCode::kResourceExhausted : ErrorCode::kFailedPrecondition,
        fmt::format("{}: can't write to the cache: {}; free some space or choose another --cache",
                    path.string(), std::strerror(error)));
}

// An open, locked DIGEST.part. Another process's lock is waited for.
class PartFile {
  public:
    explicit PartFile(fs::path path) : path_(std::move(path)) {
        for (;;) {
            fd_ = open(path_.c_str(), O_RDWR | O_CREAT | O_CLOEXEC, 0644);
            if (fd_ < 0) {
                ThrowDiskError(path_, errno);
            }
            while (flock(fd_, LOCK_EX) != 0) {
                if (errno != EINTR) {
                    const int error = errno;
                    close(fd_);
                    ThrowDiskError(path_, error);
                }
            }
            // Whoever held the lock may have renamed or removed the file meanwhile.
            struct stat mine {
            }, named{};
            if (fstat(fd_, &mine) == 0 && stat(path_.c_str(), &named) == 0 &&
                mine.st_ino == named.st_ino) {
                return;
            }
            close(fd_);
        }
    }
    ~PartFile() { close(fd_); }
    PartFile(const PartFile&) = delete;
    PartFile& operator=(const PartFile&) = delete;

    // Hashes what an earlier transfer left; a part longer than the blob is not its beginning.
    std::uint64_t Resume(std::uint64_t size, Sha256* sha) {
        std::vector<char> buffer(std::size_t{1} << 16);
        std::uint64_t offset = 0;
        for (;;) {
            const ssize_t n = pread(fd_, buffer.data(), buffer.size(), static_cast<off_t>(offset));
            if (n <= 0) {
                break;
            }
            sha->Update(buffer.data(), static_cast<std::size_t>(n));
            offset += static_cast<std::uint64_t>(n);
        }
        if (offset > size) {
            *sha = Sha256();
            offset = 0;
            if (ftruncate(fd_, 0) != 0) {
                ThrowDiskError(path_, errno);
            }
        }
        return offset;
    }

    void Write(const std::string& data, std::uint64_t offset) {
        for (std::size_t done = 0; done < data.size();) {
            const ssize_t n = pwrite(fd_, data.data() + done, data.size() - done,
                                     static_cast<off_t>(offset + done));
            if (n >= 0) {
                done += static_cast<std::size_t>(n);
            } else if (errno != EINTR) {
                const int error = errno;
                Remove();  // gives the space back
                ThrowDiskError(path_, error);
            }
        }
    }

    void Remove() const { unlink(path_.c_str()); }

    void MoveTo(const fs::path& target) const {
        if (rename(path_.c_str(), target.c_str()) != 0) {
            const int error = errno;
            Remove();
            ThrowDiskError(target, error);
        }
    }

  private:
    fs::path path_;
    int fd_ = -1;
};

// The time of a file's last use is kept as its modification time: access times are often switched
// off.
void Touch(const fs::path& path) { utimensat(AT_FDCWD, path.c_str(), nullptr, 0); }

}  // namespace

BlobCache::BlobCache(fs::path folder, std::uint64_t max_bytes)
    : folder_(std::move(folder)), max_bytes_(max_bytes) {
    std::error_code error;
    fs::create_directories(folder_, error);
    if (error || access(folder_.c_str(), W_OK | X_OK) != 0) {
        ThrowDiskError(folder_, error ? error.value() : errno);
    }
}

fs::path BlobCache::PathOf(const std::string& sha256) const {
    if (!IsSha256Hex(sha256)) {
        ThrowInvalidArgument("blob digest '" + sha256 + "' is malformed");
    }
    return folder_ / sha256;
}

bool BlobCache::Has(const std::string& sha256) const {
    std::error_code ignored;
    return fs::is_regular_file(PathOf(sha256), ignored);
}

void BlobCache::Ensure(const std::string& sha256, std::uint64_t size, const BlobFetch& fetch) {
    std::error_code error;
    if (fs::file_size(PathOf(sha256), error) == size && !error) {
        Touch(PathOf(sha256));
        return;
    }
    for (int attempt = 1;; ++attempt) {
        try {
            Download(sha256, size, fetch);
            return;
        } catch (const Error& damage) {
            if (damage.code() != ErrorCode::kDataLoss || attempt == kFetchAttempts) {
                throw;
            }
            spdlog::warn("cache: {}; fetching it again", damage.what());
        }
    }
}

std::string BlobCache::Read(const std::string& sha256, std::uint64_t size, const BlobFetch& fetch) {
    for (int attempt = 0; attempt < 3; ++attempt) {
        Ensure(sha256, size, fetch);
        std::string bytes;
        try {
            bytes = ReadFile(PathOf(sha256));
        } catch (const Error&) {
            continue;  // another process made room just now
        }
        if (Sha256Hex(bytes) == sha256) {
            return bytes;
        }
        spdlog::warn("cache: {} decayed on disk, fetching it again", sha256);
        std::error_code ignored;
        fs::remove(PathOf(sha256), ignored);
    }
    throw Error(ErrorCode::kDataLoss,
                fmt::format("{}: the cached file does not stay as it was written; check the disk",
                            PathOf(sha256).string()));
}

void BlobCache::Download(const std::string& sha256, std::uint64_t size,
                         const BlobFetch& fetch) const {
    PartFile part(folder_ / (sha256 + ".part"));
    std::error_code error;
    if (fs::file_size(PathOf(sha256), error) == size && !error) {
        part.Remove();  // it came while we waited for the lock
        return;
    }
    Sha256 sha;
    std::uint64_t offset = part.Resume(size, &sha);
    MakeRoom(size - offset, sha256);
    if (offset < size || size == 0) {
        fetch(sha256, offset, [&](const std::string& data) {
            if (data.size() > size - offset) {
                part.Remove();
                throw Error(
                    ErrorCode::kDataLoss,
                    fmt::format("blob {}: more than the promised {} bytes arrive", sha256, size));
            }
            part.Write(data, offset);
            sha.Update(data);
            offset += data.size();
        });
    }
    if (offset != size) {
        throw Error(ErrorCode::kUnavailable,
                    fmt::format("blob {}: the transfer broke off after {} of {} bytes", sha256,
                                offset, size));
    }
    if (sha.HexDigest() != sha256) {
        part.Remove();
        throw Error(ErrorCode::kDataLoss,
                    fmt::format("blob {}: what arrived is something else", sha256));
    }
    part.MoveTo(PathOf(sha256));
}

void BlobCache::MakeRoom(std::uint64_t incoming, const std::string& keep) const {
    struct File {
        fs::path path;
        fs::file_time_type used;
        std::uint64_t size;
    };
    std::vector<File> files;
    const auto now = fs::file_time_type::clock::now();
    std::uint64_t total = incoming;
    std::error_code error;
    for (const auto& entry : fs::directory_iterator(folder_, error)) {
        std::error_code gone;
        const auto size = entry.file_size(gone);
        const auto used = entry.last_write_time(gone);
        if (gone) {
            continue;  // removed by another process meanwhile
        }
        total += size;
        const std::string name = entry.path().filename().string();
        const bool stale_part =
            entry.path().extension() == ".part" && now - used > kPartLife;  // of a dead process
        if ((IsSha256Hex(name) && name != keep) || stale_part) {
            files.push_back({entry.path(), used, size});
        }
    }
    std::sort(files.begin(), files.end(),
              [](const File& a, const File& b) { return a.used < b.used; });
    for (const auto& file : files) {
        if (total <= max_bytes_) {
            break;
        }
        fs::remove(file.path, error);
        total -= file.size;
    }
}

}  // namespace relume::worker
