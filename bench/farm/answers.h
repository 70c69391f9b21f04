#pragma once

#include <grpcpp/support/byte_buffer.h>
#include <grpcpp/support/slice.h>

#include <cstdint>
#include <map>
#include <mutex>
#include <string>
#include <tuple>
#include <vector>

#include "core/film/tile.h"
#include "relume/v1/work.pb.h"

namespace relume::bench {

// A result of `task` without tracing: moments as a scene's could be, that pass the server's check.
// `noisy`: the share of pixels where feature moments are noisy; elsewhere all samples saw the same
// surface, so that both halves' means are equal and the sums of squares 0.
TileResult MakeUp(const TileTask& task, double noisy);

// Answers to leases as a worker sends them, made up once for each shape of lease; what an answer
// costs is then copying it into a socket: checksums are made once, too. Thread-safe.
class Answers {
  public:
    explicit Answers(double noisy) : noisy_(noisy) {}

    // The WorkRequest with the result of `lease`, which took `seconds` and whose codec::TaskDigest
    // is `task_digest`.
    grpc::ByteBuffer AnswerTo(const v1::Lease& lease, std::uint64_t task_digest, double seconds);

  private:
    // Of a lease: the size of its tile, the parity of its samples with their counts, and seconds.
    using Shape = std::tuple<int, int, std::vector<std::uint32_t>, double>;
    struct Made {
        grpc::Slice planes;
        std::uint64_t checksum = 0;
    };

    const double noisy_;
    std::mutex mutex_;
    std::map<Shape, Made> made_;
};

}  // namespace relume::bench
