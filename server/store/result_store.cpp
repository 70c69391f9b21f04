#include "server/store/result_store.h"

#include <fmt/format.h>

#include <algorithm>
#include <fstream>
#include <system_error>
#include <utility>

#include "core/base/error.h"
#include "server/store/data_folder.h"

namespace relume::store {

std::string ReadPiece(const std::filesystem::path& path, std::uint64_t offset, std::size_t limit) {
    std::ifstream in(path, std::ios::binary);
    if (!in) {
        ThrowNotFound(fmt::format("{}: is not there any more", path.filename().string()));
    }
    std::string bytes(limit, '\0');
    in.seekg(static_cast<std::streamoff>(offset));
    in.read(bytes.data(), static_cast<std::streamsize>(limit));
    if (in.bad()) {
        throw Error(ErrorCode::kDataLoss,
                    path.string() + ": reading failed; check the server's disk");
    }
    bytes.resize(static_cast<std::size_t>(in.gcount()));
    return bytes;
}

ResultStore::ResultStore(const std::filesystem::path& folder, std::shared_ptr<Disk> disk)
    : folder_(folder), disk_(std::move(disk)) {
    MakeFolder(folder_);
}

std::filesystem::path ResultStore::PathOf(const std::string& id) const {
    const auto allowed = [](char c) {
        return (c >= 'a' && c <= 'z') || (c >= '0' && c <= '9') || c == '-';
    };
    if (id.empty() || id.size() > 64 || !std::all_of(id.begin(), id.end(), allowed)) {
        ThrowInvalidArgument(fmt::format("'{}' can't name a result", id));
    }
    return folder_ / (id + ".exr");
}

void ResultStore::Put(const std::string& id, std::string_view bytes) {
    WriteWholeFile(disk_.get(), PathOf(id), bytes);
}

std::string ResultStore::Read(const std::string& id, std::uint64_t offset,
                              std::size_t limit) const {
    return ReadPiece(PathOf(id), offset, limit);
}

void ResultStore::Remove(const std::string& id) {
    std::error_code ignored;
    std::filesystem::remove(PathOf(id), ignored);
}

}  // namespace relume::store
