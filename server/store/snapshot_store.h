#pragma once

#include <cstdint>
#include <filesystem>
#include <functional>
#include <memory>
#include <string>
#include <string_view>

#include "core/base/sha256.h"
#include "server/store/disk.h"

namespace relume::store {

// What a snapshot's file must be.
struct SnapshotFile {
    std::string name;  // in the folder of snapshots
    std::uint64_t size = 0;
    std::string sha256;
};

// Snapshots of jobs: files of records (8 bytes of length, little-endian, and as many bytes), each
// written once. Which of them count says the ledger. Thread-safe.
class SnapshotStore {
  public:
    SnapshotStore(const std::filesystem::path& folder, std::shared_ptr<Disk> disk);

    // One that is being written; by one thread at a time. Unless Commit was called it vanishes.
    class Writer {
      public:
        ~Writer();
        Writer(const Writer&) = delete;
        Writer& operator=(const Writer&) = delete;

        // A record, which may come in two parts.
        void Add(std::string_view record, std::string_view rest = {});
        // The file has its name and survives a loss of power when this returns.
        SnapshotFile Commit();

      private:
        friend class SnapshotStore;
        Writer(SnapshotStore* store, std::string name);
        void Write(std::string_view bytes);

        SnapshotStore* store_;
        SnapshotFile made_;
        std::filesystem::path temporary_;
        std::unique_ptr<Disk::File> file_;
        std::string buffer_;
        Sha256 sha_;
    };
    // `name`: of letters, digits and '-'. It is not yet taken.
    std::unique_ptr<Writer> Begin(const std::string& name);

    // Calls `body` for each record. Throws kDataLoss unless size and digest are as they must be, at
    // the end perhaps: what `body` got counts for nothing then.
    void Read(const SnapshotFile& file, const std::function<void(std::string)>& body) const;
    void Remove(const std::string& name);
    // All files but those for which `known` says yes, left behind by earlier runs.
    void RemoveOthers(const std::function<bool(const std::string& name)>& known);

  private:
    std::filesystem::path folder_;
    std::shared_ptr<Disk> disk_;
};

}  // namespace relume::store
