#include "server/store/blob_store.h"

#include <fcntl.h>
#include <fmt/format.h>
#include <unistd.h>

#include <cerrno>
#include <chrono>
#include <system_error>
#include <utility>

#include "core/base/error.h"
#include "server/store/data_folder.h"
#include "server/store/result_store.h"

namespace relume::store {
namespace {

namespace fs = std::filesystem;

constexpr std::chrono::hours kPartLife{24 * 7};
constexpr std::size_t kHashPiece = std::size_t{1} << 20;

std::uint64_t SizeOrZero(const fs::path& path) {
    std::error_code error;
    const auto size = fs::file_size(path, error);
    return error ? 0 : size;
}

}  // namespace

BlobStore::BlobStore(const fs::path& folder, std::uint64_t quota) : folder_(folder), quota_(quota) {
    MakeFolder(folder_);
    const auto now = fs::file_time_type::clock::now();
    for (const auto& entry : fs::recursive_directory_iterator(folder_)) {
        std::error_code ignored;
        if (!entry.is_regular_file(ignored)) {
            continue;
        }
        if (entry.path().extension() == ".part" &&
            now - entry.last_write_time(ignored) > kPartLife) {
            fs::remove(entry.path(), ignored);
        } else {
            used_ += SizeOrZero(entry.path());
        }
    }
}

fs::path BlobStore::PathOf(const std::string& sha256) const {
    if (!IsSha256Hex(sha256)) {
        ThrowInvalidArgument(fmt::format(
            "'{:.80}' is no SHA-256; 64 lower-case hexadecimal digits are needed", sha256));
    }
    return folder_ / sha256.substr(0, 2) / sha256;
}

fs::path BlobStore::PartOf(const std::string& sha256) const {
    return PathOf(sha256).concat(".part");
}

bool BlobStore::Has(const std::string& sha256) const {
    std::error_code ignored;
    return fs::is_regular_file(PathOf(sha256), ignored);
}

std::uint64_t BlobStore::SizeOf(const std::string& sha256) const {
    std::error_code error;
    const auto size = fs::file_size(PathOf(sha256), error);
    if (error) {
        ThrowNotFound(fmt::format("blob {} is not here; upload it first", sha256));
    }
    return size;
}

std::uint64_t BlobStore::PartSize(const std::string& sha256) const {
    return SizeOrZero(PartOf(sha256));
}

std::string BlobStore::Read(const std::string& sha256, std::uint64_t offset,
                            std::size_t limit) const {
    return ReadPiece(PathOf(sha256), offset, limit);
}

std::uint64_t BlobStore::used() const {
    const std::lock_guard lock(mutex_);
    return used_;
}

std::unique_ptr<BlobStore::Upload> BlobStore::Begin(const std::string& sha256, std::uint64_t size,
                                                    std::uint64_t offset) {
    const fs::path part = PartOf(sha256);
    {
        const std::lock_guard lock(mutex_);
        if (uploading_.count(sha256) != 0) {
            throw Error(
                ErrorCode::kUnavailable,
                fmt::format("blob {} is being uploaded by another client; try again", sha256));
        }
        const std::uint64_t there = SizeOrZero(part);
        if (offset > there || offset > size) {
            ThrowInvalidArgument(fmt::format("blob {} goes on at byte {} of {}, not at {}", sha256,
                                             there, size, offset));
        }
        const std::uint64_t others = used_ - there;
        if (size > quota_ || others > quota_ - size) {
            throw Error(
                ErrorCode::kResourceExhausted,
                fmt::format("blob {} of {} bytes does not fit: {} of {} bytes are used; ask for a "
                            "larger --blob-quota",
                            sha256, size, others, quota_));
        }
        used_ = others + size;
        uploading_.insert(sha256);
    }
    // From here on the destructor undoes what was noted.
    std::unique_ptr<Upload> upload(new Upload(this, sha256, size));
    MakeFolder(part.parent_path());
    upload->file_ = open(part.c_str(), O_CREAT | O_WRONLY | O_CLOEXEC, 0644);
    if (upload->file_ < 0 || ftruncate(upload->file_, static_cast<off_t>(offset)) != 0 ||
        lseek(upload->file_, 0, SEEK_END) < 0) {
        ThrowFileError(part, "write", errno);
    }
    while (upload->offset_ < offset) {
        const std::string piece = ReadPiece(part, upload->offset_, kHashPiece);
        if (piece.empty()) {
            throw Error(ErrorCode::kDataLoss, part.string() + ": shrank while it was read");
        }
        upload->sha_.Update(piece);
        upload->offset_ += piece.size();
    }
    return upload;
}

BlobStore::Upload::Upload(BlobStore* store, std::string sha256, std::uint64_t size)
    : store_(store), sha256_(std::move(sha256)), size_(size) {}

BlobStore::Upload::~Upload() {
    if (file_ >= 0) {
        close(file_);
    }
    const std::uint64_t there = store_->Has(sha256_) ? size_ : SizeOrZero(store_->PartOf(sha256_));
    const std::lock_guard lock(store_->mutex_);
    store_->used_ -= size_ - std::min(size_, there);
    store_->uploading_.erase(sha256_);
}

void BlobStore::Upload::Discard() {
    std::error_code ignored;
    fs::remove(store_->PartOf(sha256_), ignored);
}

void BlobStore::Upload::Append(std::string_view bytes) {
    if (bytes.size() > size_ - offset_) {
        Discard();
        ThrowInvalidArgument(
            fmt::format("blob {} has more than the {} bytes said", sha256_, size_));
    }
    for (std::size_t done = 0; done < bytes.size();) {
        const ssize_t n = write(file_, bytes.data() + done, bytes.size() - done);
        if (n > 0) {
            done += static_cast<std::size_t>(n);
        } else if (n < 0 && errno != EINTR) {
            const int error = errno;
            Discard();
            ThrowFileError(store_->PartOf(sha256_), "write", error);
        }
    }
    sha_.Update(bytes);
    offset_ += bytes.size();
}

void BlobStore::Upload::Commit() {
    const fs::path part = store_->PartOf(sha256_);
    if (const std::string digest = sha_.HexDigest(); !complete() || digest != sha256_) {
        Discard();
        throw Error(
            ErrorCode::kDataLoss,
            fmt::format("blob {} came with the contents of {}; upload it again", sha256_, digest));
    }
    if (fsync(file_) != 0 || rename(part.c_str(), store_->PathOf(sha256_).c_str()) != 0) {
        const int error = errno;
        Discard();
        ThrowFileError(part, "finish", error);
    }
}

}  // namespace relume::store
