#include "server/store/snapshot_store.h"

#include <fmt/format.h>

#include <algorithm>
#include <cstring>
#include <fstream>
#include <system_error>
#include <utility>
#include <vector>

#include "core/base/error.h"
#include "server/store/data_folder.h"

namespace relume::store {
namespace {

namespace fs = std::filesystem;

constexpr std::size_t kBuffer = std::size_t{64} << 10;  // tiles go past it, uncopied

void CheckName(const std::string& name) {
    const auto allowed = [](char c) {
        return (c >= 'a' && c <= 'z') || (c >= '0' && c <= '9') || c == '-';
    };
    if (name.empty() || name.size() > 128 || !std::all_of(name.begin(), name.end(), allowed)) {
        ThrowInvalidArgument(fmt::format("'{:.128}' can't name a snapshot", name));
    }
}

}  // namespace

SnapshotStore::SnapshotStore(const fs::path& folder, std::shared_ptr<Disk> disk)
    : folder_(folder), disk_(std::move(disk)) {
    MakeFolder(folder_);
}

std::unique_ptr<SnapshotStore::Writer> SnapshotStore::Begin(const std::string& name) {
    CheckName(name);
    return std::unique_ptr<Writer>(new Writer(this, name));
}

SnapshotStore::Writer::Writer(SnapshotStore* store, std::string name)
    : store_(store), temporary_(store->folder_ / (name + ".new")) {
    made_.name = std::move(name);
    file_ = store_->disk_->Create(temporary_);
    buffer_.reserve(kBuffer);
}

SnapshotStore::Writer::~Writer() {
    if (made_.sha256.empty()) {
        file_.reset();
        store_->disk_->Remove(temporary_);
    }
}

void SnapshotStore::Writer::Add(std::string_view record, std::string_view rest) {
    const std::uint64_t length = record.size() + rest.size();
    char bytes[sizeof length];
    std::memcpy(bytes, &length, sizeof length);
    Write({bytes, sizeof bytes});
    Write(record);
    Write(rest);
}

void SnapshotStore::Writer::Write(std::string_view bytes) {
    if (buffer_.size() + bytes.size() > kBuffer) {
        file_->Write(buffer_);
        buffer_.clear();
    }
    if (bytes.size() > kBuffer) {
        file_->Write(bytes);
    } else {
        buffer_ += bytes;
    }
    sha_.Update(bytes);
    made_.size += bytes.size();
}

SnapshotFile SnapshotStore::Writer::Commit() {
    file_->Write(buffer_);
    file_->Sync();
    store_->disk_->Rename(temporary_, store_->folder_ / made_.name);
    made_.sha256 = sha_.HexDigest();
    return made_;
}

void SnapshotStore::Read(const SnapshotFile& file,
                         const std::function<void(std::string)>& body) const {
    CheckName(file.name);
    const fs::path path = folder_ / file.name;
    const auto damaged = [&](const char* how) {
        return Error(ErrorCode::kDataLoss, fmt::format("{}: {}", path.string(), how));
    };
    std::error_code error;
    if (const auto size = fs::file_size(path, error); error || size != file.size) {
        throw damaged(error ? "is not there" : "has another size than it was written with");
    }
    std::ifstream in(path, std::ios::binary);
    Sha256 sha;
    for (std::uint64_t left = file.size; left > 0;) {
        std::uint64_t length = 0;
        char bytes[sizeof length];
        if (left < sizeof length || !in.read(bytes, sizeof bytes)) {
            throw damaged("can't be read");
        }
        std::memcpy(&length, bytes, sizeof length);
        left -= sizeof length;
        if (length > left) {
            throw damaged("is damaged");
        }
        std::string record(length, '\0');
        if (!in.read(record.data(), static_cast<std::streamsize>(length))) {
            throw damaged("can't be read");
        }
        left -= length;
        sha.Update(bytes, sizeof bytes);
        sha.Update(record);
        body(std::move(record));
    }
    if (sha.HexDigest() != file.sha256) {
        throw damaged("is damaged");
    }
}

void SnapshotStore::Remove(const std::string& name) {
    CheckName(name);
    disk_->Remove(folder_ / name);
}

void SnapshotStore::RemoveOthers(const std::function<bool(const std::string& name)>& known) {
    std::vector<fs::path> others;
    for (const auto& entry : fs::directory_iterator(folder_)) {
        if (!known(entry.path().filename().string())) {
            others.push_back(entry.path());
        }
    }
    for (const auto& path : others) {
        disk_->Remove(path);
    }
}

}  // namespace relume::store
