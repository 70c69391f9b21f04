#include "bench/farm/answers.h"

#include <gtest/gtest.h>

#include "core/film/aov.h"
#include "proto/codec/codec.h"
#include "proto/codec/digests.h"
#include "server/jobs/check_result.h"

namespace relume::bench {
namespace {

std::string Bytes(const grpc::ByteBuffer& buffer) {
    std::vector<grpc::Slice> slices;
    EXPECT_TRUE(buffer.Dump(&slices).ok());
    std::string bytes;
    for (const grpc::Slice& slice : slices) {
        bytes.append(reinterpret_cast<const char*>(slice.begin()), slice.size());
    }
    return bytes;
}

v1::Lease LeaseOf(const TileTask& task) {
    v1::Lease lease;
    codec::TaskToLease(task, &lease);
    lease.set_id(7);
    lease.set_job("jobs/1");
    lease.set_epoch(3);
    lease.set_unit(12);
    lease.set_ticket("0123");
    return lease;
}

TEST(Answers, AreWhatTheServerTakes) {
    Answers answers(0.5);
    const TileTask even{{0, 0, 3, 2}, {0, 0, 0, 0, 0, 0}, {64, 64, 64, 64, 64, 64}};
    const TileTask odd{{3, 2, 6, 4}, {1, 1, 1, 1, 1, 1}, {64, 63, 64, 64, 64, 64}};
    const TileTask few{{6, 0, 8, 1}, {5, 8}, {0, 1}};
    for (const TileTask& task : {even, odd, few, even}) {
        v1::WorkRequest message;
        ASSERT_TRUE(message.ParseFromString(Bytes(answers.AnswerTo(LeaseOf(task), 99, 0.25))));
        const v1::LeaseResult& result = message.result();
        EXPECT_EQ(result.lease_id(), 7u);
        EXPECT_EQ(result.job(), "jobs/1");
        EXPECT_EQ(result.seconds(), 0.25);
        EXPECT_EQ(result.epoch(), 3u);
        EXPECT_EQ(result.unit(), 12u);
        EXPECT_EQ(result.ticket(), "0123");
        EXPECT_EQ(result.task_digest(), 99u);
        TileResult decoded = codec::DecodePlanes(task, result.planes());
        decoded.rays = result.rays();
        decoded.seconds = result.seconds();
        EXPECT_NO_THROW(jobs::CheckResult(task, decoded));
        EXPECT_NO_THROW(codec::CheckChecksum(decoded, result));
    }
}

TEST(Answers, HaveNoisyFeaturesWhereTheyAreToBe) {
    TileTask task{{0, 0, 16, 16}, {}, {}};
    task.first.assign(task.rect.area(), 0);
    task.count.assign(task.rect.area(), 8);
    const auto noisy_values = [&](double noisy) {
        const TileResult result = MakeUp(task, noisy);
        std::size_t values = 0;
        for (std::size_t i = kFeatureM2 * result.pixels.size(); i < result.planes.size(); ++i) {
            values += result.planes[i] > 0 ? 1 : 0;
        }
        return values;
    };
    EXPECT_EQ(noisy_values(0), 0u);
    EXPECT_EQ(noisy_values(1), task.rect.area() * kFeatureCount);
}

}  // namespace
}  // namespace relume::bench
