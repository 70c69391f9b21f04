#include "server/rpc/ticket.h"

#include "core/base/byte_stream.h"
#include "core/base/sha256.h"

namespace relume::server {

std::string MakeTicket(const std::string& secret, const std::string& job, std::uint64_t unit,
                       const TileTask& task) {
    ByteWriter bytes;
    bytes.PutText(secret);
    bytes.PutText(job);
    bytes.Put(unit);
    bytes.Put(task.rect);
    bytes.PutAll(task.first);
    bytes.PutAll(task.count);
    bytes.Put<std::uint8_t>(task.keep_samples ? 1 : 0);
    // Of a length that tells nothing of how SHA-256 would go on.
    return Sha256Hex(bytes.Take()).substr(0, 32);
}

}  // namespace relume::server
