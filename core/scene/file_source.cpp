#include <fmt/format.h>

#include <algorithm>
#include <filesystem>

#include "core/base/error.h"
#include "core/base/files.h"
#include "core/scene/formats.h"
#include "core/scene/manifest.h"

namespace relume {
namespace {

namespace fs = std::filesystem;

bool IsBelow(const fs::path& path, const fs::path& folder) {
    return std::mismatch(folder.begin(), folder.end(), path.begin(), path.end()).first ==
           folder.end();
}

class FolderSource final : public FileSource {
  public:
    explicit FolderSource(const std::string& folder) : folder_(folder.empty() ? "." : folder) {
        std::error_code error;
        root_ = fs::weakly_canonical(folder_, error);
    }

    std::string Read(const std::string& name) const override {
        const fs::path path = folder_ / name;
        if (!IsSafeRelativePath(name)) {
            ThrowInvalidArgument(
                fmt::format("'{}' is not a path below the scene's folder {}; move the file there",
                            name, folder_.string()));
        }
        std::error_code error;
        const fs::path real = fs::weakly_canonical(path, error);
        if (error || !fs::exists(real, error)) {
            ThrowNotFound(
                fmt::format("{}: missing; restore the file or correct the path", path.string()));
        }
        if (!IsBelow(real, root_)) {
            ThrowInvalidArgument(fmt::format(
                "{}: is a link that leaves the scene's folder; put the file itself there",
                path.string()));
        }
        if (!fs::is_regular_file(real, error)) {
            ThrowInvalidArgument(fmt::format("{}: is not a file; correct the path", path.string()));
        }
        return ReadFile(real);
    }

  private:
    fs::path folder_;  // as given, for messages
    fs::path root_;    // without links
};

}  // namespace

std::unique_ptr<FileSource> MakeFolderSource(const std::string& folder) {
    return std::make_unique<FolderSource>(folder);
}

}  // namespace relume
