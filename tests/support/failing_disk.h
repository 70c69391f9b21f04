#pragma once

#include <atomic>
#include <cstdint>
#include <memory>
#include <utility>

#include "core/base/error.h"
#include "server/store/disk.h"

namespace relume::test {

// The real disk until it is said to be full: then nothing more can be written, as the operating
// system would say it. Thread-safe.
class FailingDisk final : public store::Disk {
  public:
    std::atomic<bool> full{false};
    std::atomic<int> refused{0};  // writes

    std::unique_ptr<File> Create(const std::filesystem::path& path) override {
        Check();
        return std::make_unique<Checked>(this, real_->Create(path));
    }
    void Rename(const std::filesystem::path& from, const std::filesystem::path& to) override {
        real_->Rename(from, to);
    }
    void Remove(const std::filesystem::path& path) override { real_->Remove(path); }

  private:
    class Checked final : public File {
      public:
        Checked(FailingDisk* disk, std::unique_ptr<File> file)
            : disk_(disk), file_(std::move(file)) {}
        void Write(std::string_view bytes) override {
            disk_->Check();
            file_->Write(bytes);
        }
        void Sync() override {
            disk_->Check();
            file_->Sync();
        }

      private:
        FailingDisk* disk_;
        std::unique_ptr<File> file_;
    };
    void Check() {
        if (full) {
            ++refused;
            throw Error(ErrorCode::kResourceExhausted,
                        "can't write: No space left on device; free some space on the server");
        }
    }

    std::shared_ptr<store::Disk> real_ = store::RealDisk();
};

}  // namespace relume::test
