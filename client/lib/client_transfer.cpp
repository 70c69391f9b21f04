#include <fmt/format.h>

#include <algorithm>
#include <fstream>
#include <map>
#include <string>

#include "client/lib/client.h"
#include "client/lib/client_calls.h"
#include "client/lib/job_names.h"
#include "core/base/error.h"
#include "core/base/sha256.h"
#include "proto/codec/codec.h"

// Bytes there and back: scenes up, results down.
namespace relume::client {
namespace {

constexpr double kChunkSeconds = 600;  // one blob, one result

}  // namespace

void Client::UploadScene(const LocalScene& scene,
                         const std::function<void(std::uint64_t, std::uint64_t)>& progress) {
    // Which blobs lack, and how much of each.
    std::map<std::string, const ManifestEntry*> entries;
    v1::FindMissingBlobsRequest request;
    for (const auto& entry : scene.manifest.entries) {
        if (entries.emplace(entry.sha256, &entry).second) {
            request.add_sha256(entry.sha256);
        }
    }
    v1::FindMissingBlobsResponse missing;
    Insist([&](grpc::ClientContext* context) {
        return blobs_->FindMissingBlobs(context, request, &missing);
    });
    std::uint64_t due = 0, done = 0;
    for (const auto& blob : missing.missing()) {
        due += entries.at(blob.sha256())->size - blob.offset();
    }
    for (const auto& blob : missing.missing()) {
        const ManifestEntry& entry = *entries.at(blob.sha256());
        UploadBlob(entry.sha256, entry.size, blob.offset(), scene.files.at(entry.path),
                   [&](std::uint64_t bytes) { progress(done + bytes, due); });
        done += entry.size - blob.offset();
    }
}

void Client::UploadBlob(const std::string& sha256, std::uint64_t size, std::uint64_t offset,
                        const std::string& path,
                        const std::function<void(std::uint64_t)>& progress) {
    Retry retry(this);
    const std::uint64_t start = offset;
    int damages = 0;
    std::uint64_t kept = offset;  // bytes that the server is known to have
    for (;;) {
        std::ifstream in(path, std::ios::binary);
        in.seekg(static_cast<std::streamoff>(offset));
        CallContext context(this, kChunkSeconds);
        v1::WriteBlobResponse response;
        const auto writer = blobs_->WriteBlob(context.get(), &response);
        v1::WriteBlobRequest chunk;
        chunk.set_sha256(sha256);
        chunk.set_size(size);
        std::string buffer;
        do {
            // Half the limit: room for the message's other fields.
            buffer.resize(std::min<std::uint64_t>(codec::kMaxChunk / 2, size - offset));
            if (!in.read(buffer.data(), static_cast<std::streamsize>(buffer.size()))) {
                context.get()->TryCancel();
                writer->Finish();
                throw Error(ErrorCode::kDataLoss,
                            fmt::format("{}: changed while it was sent; try again", path));
            }
            chunk.set_offset(offset);
            chunk.set_data(buffer);
            if (!writer->Write(chunk)) {
                break;
            }
            chunk.clear_sha256();
            chunk.clear_size();
            offset += buffer.size();
            progress(offset - std::min(start, offset));
        } while (offset < size);
        writer->WritesDone();
        const auto status = writer->Finish();
        if (status.ok()) {
            return;
        }
        // Bits changed on the way. The server has thrown away what it got.
        const bool damaged = status.error_code() == grpc::StatusCode::DATA_LOSS;
        if (!damaged || ++damages == kUploadAttempts) {
            retry.Wait(status);
        }

        // Where the server wants us to go on.
        v1::FindMissingBlobsRequest request;
        request.add_sha256(sha256);
        v1::FindMissingBlobsResponse missing;
        CallContext ask(this, kUnarySeconds);
        if (!blobs_->FindMissingBlobs(ask.get(), request, &missing).ok()) {
            continue;
        }
        if (missing.missing().empty()) {
            return;
        }
        offset = missing.missing(0).offset();
        if (offset > std::exchange(kept, offset)) {
            retry.Progress();
        }
    }
}

void Client::Fetch(const std::string& name, OutputFile* file) {
    v1::FetchResultRequest request;
    request.set_name(JobName(name));
    Sha256 sha;
    for (Retry retry(this);;) {
        request.set_offset(file->size());
        CallContext context(this, kChunkSeconds);
        const auto reader = jobs_->FetchResult(context.get(), request);
        v1::FetchResultResponse chunk;
        std::uint64_t size = 0;
        std::string sha256;
        try {
            while (reader->Read(&chunk)) {
                if (chunk.offset() != file->size()) {
                    throw Error(
                        ErrorCode::kDataLoss,
                        fmt::format("{}: the server sent byte {} of {} instead of {}",
                                    server_.address, chunk.offset(), request.name(), file->size()));
                }
                sha.Update(chunk.data());
                file->Append(chunk.data());
                size = chunk.size();
                sha256 = chunk.sha256();
                retry.Progress();
            }
        } catch (...) {
            context.get()->TryCancel();
            reader->Finish();
            throw;
        }
        const auto status = reader->Finish();
        if (status.ok() && file->size() == size) {
            if (sha.HexDigest() != sha256) {
                throw Error(
                    ErrorCode::kDataLoss,
                    fmt::format("{}: the result of {} was damaged on its way; fetch it again",
                                server_.address, request.name()));
            }
            return;
        }
        retry.Wait(status.ok() ? grpc::Status(grpc::StatusCode::UNAVAILABLE, "the result broke off")
                               : status);
    }
}

}  // namespace relume::client
