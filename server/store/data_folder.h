#pragma once

#include <filesystem>

namespace relume::store {

// The server's folder, made if it is not there and held for as long as the object lives: a second
// server on it would undo the first one's work.
class DataFolder {
  public:
    // Throws kFailedPrecondition if it can't be made, written or is in use.
    explicit DataFolder(const std::filesystem::path& path);
    ~DataFolder();
    DataFolder(const DataFolder&) = delete;
    DataFolder& operator=(const DataFolder&) = delete;

    const std::filesystem::path& path() const { return path_; }

  private:
    std::filesystem::path path_;
    int lock_ = -1;
};

// Makes the folder and its parents. Throws kFailedPrecondition that names it.
void MakeFolder(const std::filesystem::path& path);

// kResourceExhausted for a full disk, else kFailedPrecondition; one line with path, reason and
// remedy.
[[noreturn]] void ThrowFileError(const std::filesystem::path& path, const char* doing, int error);

}  // namespace relume::store
