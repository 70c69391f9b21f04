#include "bench/farm/answers.h"

#include <google/protobuf/io/coded_stream.h>
#include <google/protobuf/io/zero_copy_stream_impl_lite.h>
#include <google/protobuf/wire_format_lite.h>

#include <random>

#include "core/film/aov.h"
#include "core/film/moments.h"
#include "proto/codec/codec.h"
#include "proto/codec/digests.h"

namespace relume::bench {
namespace {

using google::protobuf::internal::WireFormatLite;

// Samples of one pixel are drawn from this many, so that a tile is made up in a moment.
constexpr std::uint32_t kMostDrawn = 64;

std::uint32_t Tag(int field) {
    return WireFormatLite::MakeTag(field, WireFormatLite::WIRETYPE_LENGTH_DELIMITED);
}

}  // namespace

TileResult MakeUp(const TileTask& task, double noisy) {
    TileResult result;
    result.rect = task.rect;
    for (std::size_t i = 0; i < task.count.size(); ++i) {
        if (task.count[i] > 0) {
            result.pixels.push_back(static_cast<std::uint32_t>(i));
        }
    }
    const std::size_t n = result.pixels.size();
    result.planes.resize(n * kFilmChannelCount);
    std::mt19937 random(1);
    std::uniform_real_distribution<float> any(0, 1);
    for (std::size_t k = 0; k < n; ++k) {
        const std::size_t i = result.pixels[k];
        const bool surface_varies = any(random) < noisy;
        PixelMoments moments;
        PixelSample sample;
        for (float& f : sample.features) {
            f = any(random);
        }
        for (std::uint32_t s = 0; s < std::min(task.count[i], kMostDrawn); ++s) {
            sample.radiance = {any(random), any(random), any(random)};
            sample.indirect_luminance = any(random);
            for (float& f : sample.features) {
                f = surface_varies ? any(random) : f;
            }
            moments.Add(task.first[i] + s, sample);
        }
        moments.Store(result.planes.data() + k, n);
        const std::uint32_t even = (task.count[i] + (task.first[i] % 2 == 0 ? 1 : 0)) / 2;
        result.planes[kCountA * n + k] = static_cast<float>(even);
        result.planes[kCountB * n + k] = static_cast<float>(task.count[i] - even);
    }
    return result;
}

// The message is put together by hand, so that the planes are never copied: gRPC sends the slices
// one after the other.
grpc::ByteBuffer Answers::AnswerTo(const v1::Lease& lease, std::uint64_t task_digest,
                                   double seconds) {
    TileTask task = codec::TaskFromLease(lease);
    Shape shape{task.rect.width(), task.rect.height(), task.count, seconds};
    for (std::size_t i = 0; i < task.count.size(); ++i) {
        std::get<2>(shape)[i] = task.count[i] * 2 + task.first[i] % 2;
    }
    const std::uint64_t rays = task.TotalSamples() * 4;
    Made made;
    {
        const std::lock_guard lock(mutex_);
        Made& kept = made_[shape];
        if (kept.checksum == 0) {
            TileResult result = MakeUp(task, noisy_);
            result.rays = rays;
            result.seconds = seconds;
            kept = {grpc::Slice(codec::EncodePlanes(result)), codec::ResultChecksum(result)};
        }
        made = kept;
    }
    v1::LeaseResult before, after;
    before.set_lease_id(lease.id());
    before.set_job(lease.job());
    after.set_rays(rays);
    after.set_seconds(seconds);
    after.set_epoch(lease.epoch());
    after.set_unit(lease.unit());
    after.set_ticket(lease.ticket());
    after.set_task_digest(task_digest);
    after.set_checksum(made.checksum);
    const std::string head = before.SerializeAsString(), tail = after.SerializeAsString();

    using google::protobuf::io::CodedOutputStream;
    const std::uint32_t planes_tag = Tag(v1::LeaseResult::kPlanesFieldNumber);
    const auto planes_size = static_cast<std::uint32_t>(made.planes.size());
    const std::size_t size = head.size() + CodedOutputStream::VarintSize32(planes_tag) +
                             CodedOutputStream::VarintSize32(planes_size) + made.planes.size() +
                             tail.size();
    std::string opening;
    {
        google::protobuf::io::StringOutputStream string(&opening);
        CodedOutputStream out(&string);
        out.WriteTag(Tag(v1::WorkRequest::kResultFieldNumber));
        out.WriteVarint32(static_cast<std::uint32_t>(size));
        out.WriteString(head);
        out.WriteTag(planes_tag);
        out.WriteVarint32(planes_size);
    }
    const grpc::Slice slices[] = {grpc::Slice(opening), made.planes, grpc::Slice(tail)};
    return {slices, 3};
}

}  // namespace relume::bench
