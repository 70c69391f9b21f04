#pragma once

#include <cstdint>
#include <string>
#include <string_view>

#include "core/base/error.h"

namespace relume::client {

// A result can't be put where the user wants it.
class OutputError : public Error {
  public:
    using Error::Error;
};

// Throws OutputError unless a file can be made at `path`: its folder is there and takes files, and
// `path` is no folder itself. Leaves nothing behind.
void CheckOutput(const std::string& path);

// A file that appears under its name only when it is whole: written under a temporary name in the
// same folder, synced and renamed; without Commit nothing is left. Links are followed; to a device
// or a pipe the bytes go at Commit. Errors are OutputErrors that name path and reason. Not
// thread-safe.
class OutputFile {
  public:
    explicit OutputFile(std::string path);
    ~OutputFile();
    OutputFile(const OutputFile&) = delete;
    OutputFile& operator=(const OutputFile&) = delete;

    void Append(std::string_view bytes);
    std::uint64_t size() const { return size_; }
    // Where the bytes lie until Commit.
    const std::string& temporary() const { return temporary_; }
    void Commit();

  private:
    void CopyToDevice();

    std::string path_;     // as given, for messages
    std::string target_;   // where links lead
    bool device_ = false;  // target_ is no file
    std::string temporary_;
    int fd_ = -1;
    std::uint64_t size_ = 0;
};

}  // namespace relume::client
