#pragma once

#include <grpcpp/channel.h>

#include <memory>
#include <string>

#include "core/base/cancel_token.h"
#include "worker/loop/blob_cache.h"

namespace relume::worker {

// Reads blobs by BlobService.ReadBlob. Thread-safe. `server` is for messages; a read ends with
// kCancelled soon after `cancel`, which outlives the function, is set.
BlobFetch MakeBlobFetch(const std::shared_ptr<grpc::Channel>& channel, const std::string& server,
                        const CancelToken* cancel);

}  // namespace relume::worker
