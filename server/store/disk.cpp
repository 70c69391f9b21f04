#include "server/store/disk.h"

#include <fcntl.h>
#include <unistd.h>

#include <cerrno>
#include <system_error>

#include "server/store/data_folder.h"

namespace relume::store {
namespace {

namespace fs = std::filesystem;

class RealFile final : public Disk::File {
  public:
    explicit RealFile(const fs::path& path)
        : path_(path), fd_(open(path.c_str(), O_CREAT | O_TRUNC | O_WRONLY | O_CLOEXEC, 0644)) {
        if (fd_ < 0) {
            ThrowFileError(path_, "write", errno);
        }
    }
    ~RealFile() override { close(fd_); }
    RealFile(const RealFile&) = delete;
    RealFile& operator=(const RealFile&) = delete;

    void Write(std::string_view bytes) override {
        while (!bytes.empty()) {
            const ssize_t n = write(fd_, bytes.data(), bytes.size());
            if (n > 0) {
                bytes.remove_prefix(static_cast<std::size_t>(n));
            } else if (n < 0 && errno != EINTR) {
                ThrowFileError(path_, "write", errno);
            }
        }
    }
    void Sync() override {
        if (fsync(fd_) != 0) {
            ThrowFileError(path_, "write", errno);
        }
    }

  private:
    fs::path path_;
    int fd_;
};

class Real final : public Disk {
  public:
    std::unique_ptr<File> Create(const fs::path& path) override {
        return std::make_unique<RealFile>(path);
    }
    void Rename(const fs::path& from, const fs::path& to) override {
        if (rename(from.c_str(), to.c_str()) != 0) {
            ThrowFileError(to, "rename a file to this", errno);
        }
        // The name itself is in the folder, which is written apart.
        const int folder = open(to.parent_path().c_str(), O_RDONLY | O_DIRECTORY | O_CLOEXEC);
        if (folder < 0 || fsync(folder) != 0) {
            const int error = errno;
            if (folder >= 0) {
                close(folder);
            }
            ThrowFileError(to.parent_path(), "sync", error);
        }
        close(folder);
    }
    void Remove(const fs::path& path) override {
        std::error_code ignored;
        fs::remove(path, ignored);
    }
};

}  // namespace

std::shared_ptr<Disk> RealDisk() { return std::make_shared<Real>(); }

void WriteWholeFile(Disk* disk, const fs::path& path, std::string_view bytes) {
    const fs::path temporary = path.string() + ".new";
    try {
        const auto file = disk->Create(temporary);
        file->Write(bytes);
        file->Sync();
        disk->Rename(temporary, path);
    } catch (...) {
        disk->Remove(temporary);
        throw;
    }
}

}  // namespace relume::store
