#include "proto/codec/digests.h"

#include <fmt/format.h>

#include <vector>

#include "core/base/byte_stream.h"
#include "core/base/error.h"
#include "core/base/xxh64.h"
#include "proto/codec/codec.h"

namespace relume::codec {
namespace {

template <typename T>
std::string_view Bytes(const std::vector<T>& values) {
    return {reinterpret_cast<const char*>(values.data()), values.size() * sizeof(T)};
}

std::uint64_t NotZero(std::uint64_t digest) { return digest == 0 ? 1 : digest; }

void Compare(const char* what, std::uint64_t said, std::uint64_t due) {
    if (said != due) {
        throw Error(ErrorCode::kDataLoss,
                    said == 0 ? fmt::format("comes without a checksum of its {}", what)
                              : fmt::format("the checksum of its {} is {:016x}, {:016x} is due: "
                                            "bits changed on the way or in a machine's memory",
                                            what, said, due));
    }
}

}  // namespace

std::uint64_t ContextDigest(const std::string& job, const SceneManifest& manifest,
                            const RenderSettings& settings) {
    ByteWriter bytes;
    bytes.PutText(job);
    bytes.PutText(ManifestDigest(manifest));
    // A message without maps has one form in all processes of a build, and workers are of the
    // server's.
    bytes.PutText(ToProto(settings).SerializeAsString());
    return NotZero(Xxh64(bytes.Take()));
}

std::uint64_t TaskDigest(std::uint64_t context, std::uint64_t unit, const TileTask& task) {
    ByteWriter bytes;
    bytes.Put(context);
    bytes.Put(unit);
    bytes.Put(task.rect);
    bytes.Put<std::uint8_t>(task.keep_samples ? 1 : 0);
    return NotZero(Xxh64(Bytes(task.count), Xxh64(Bytes(task.first), Xxh64(bytes.Take()))));
}

std::uint64_t ResultChecksum(const TileResult& result) {
    ByteWriter bytes;
    bytes.Put(result.rays);
    bytes.Put(result.seconds);
    return NotZero(Xxh64(Bytes(result.samples), Xxh64(Bytes(result.planes), Xxh64(bytes.Take()))));
}

void SetDigests(std::uint64_t task_digest, const TileResult& result, v1::LeaseResult* message) {
    message->set_task_digest(task_digest);
    message->set_checksum(ResultChecksum(result));
}

void CheckTaskDigest(std::uint64_t due, const v1::LeaseResult& message) {
    Compare("task", message.task_digest(), due);
}

void CheckChecksum(const TileResult& result, const v1::LeaseResult& message) {
    Compare("contents", message.checksum(), ResultChecksum(result));
}

}  // namespace relume::codec
