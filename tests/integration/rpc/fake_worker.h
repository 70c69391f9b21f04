#pragma once

#include <grpcpp/channel.h>
#include <grpcpp/client_context.h>

#include <atomic>
#include <functional>
#include <map>
#include <memory>
#include <string>
#include <thread>
#include <vector>

#include "core/film/aov.h"
#include "proto/codec/codec.h"
#include "proto/codec/digests.h"
#include "proto/codec/protocol.h"
#include "relume/v1/work.grpc.pb.h"
#include "tests/unit/jobs/pseudo_renderer.h"

namespace relume::server {

struct FakeWorkerOptions {
    std::string name = "fake";
    std::string isa = "avx2";
    std::string machine;
    std::uint32_t version = kProtocolVersion;
    std::string build = kBuild;
    std::uint32_t credits = 3;
    int die_after = -1;     // results; then the connection breaks with leases in hand
    int stall_after = -1;   // results; then no lease is answered any more
    int wrong_until = 0;    // so many results are wrong
    int garbled_until = 0;  // so many results have a bit changed on the way
    int misread_until = 0;  // so many leases are taken for their neighbours
    int short_until = 0;    // so many results come with a sample too few, of those that are kept
    bool odd = false;       // all results are off by a little, as of bad memory
    std::string problem;    // says this of every job instead of rendering
    bool hold = false;      // takes leases and never answers
};

// A worker that renders pseudo samples, one lease at a time, on a thread of its own.
class FakeWorker {
  public:
    FakeWorker(const std::shared_ptr<grpc::Channel>& channel, FakeWorkerOptions options)
        : options_(std::move(options)), stub_(v1::WorkerService::NewStub(channel)) {
        thread_ = std::thread([this] { Run(); });
    }
    ~FakeWorker() {
        context_.TryCancel();
        thread_.join();
    }

    // Waits until the stream has ended.
    grpc::Status Join() {
        ended_.wait(false);
        return status_;
    }
    int leases() const { return leases_; }
    int revoked() const { return revoked_; }
    int acknowledged() const { return acknowledged_; }
    // Waits until so many answers are acknowledged.
    void WaitForAcknowledged(int count) { WaitFor(&acknowledged_, count); }
    bool drained() const { return drained_; }
    int jobs_over() const { return jobs_over_; }
    // Waits until the server has said of so many jobs that they are over.
    void WaitForJobsOver(int count) { WaitFor(&jobs_over_, count); }
    // Waits until it was lent so many leases.
    void WaitForLeases(int count) { WaitFor(&leases_, count); }

  private:
    static void WaitFor(const std::atomic<int>* value, int least) {
        for (int now = *value; now < least; now = *value) {
            value->wait(now);
        }
    }

    void Run() {
        const auto stream = stub_->Work(&context_);
        v1::WorkRequest hello;
        hello.mutable_hello()->set_name(options_.name);
        hello.mutable_hello()->set_protocol_version(options_.version);
        hello.mutable_hello()->mutable_numeric_class()->set_build(options_.build);
        hello.mutable_hello()->mutable_numeric_class()->set_isa(options_.isa);
        hello.mutable_hello()->set_threads(1);
        hello.mutable_hello()->set_machine(options_.machine);
        stream->Write(hello);
        v1::WorkRequest report;
        report.mutable_report()->set_credits(options_.credits);
        stream->Write(report);
        v1::WorkResponse message;
        std::map<std::string, v1::JobContext> contexts;
        int results = 0;
        while (stream->Read(&message)) {
            if (message.has_job()) {
                contexts[message.job().job()] = message.job();
            }
            if (message.has_job() && !options_.problem.empty()) {
                v1::WorkRequest answer;
                answer.mutable_problem()->set_job(message.job().job());
                answer.mutable_problem()->set_message(options_.problem);
                stream->Write(answer);
            } else if (message.has_job()) {
                v1::WorkRequest answer;
                answer.mutable_scene_ready()->set_job(message.job().job());
                answer.mutable_scene_ready()->add_notes("pretended");
                stream->Write(answer);
            } else if (message.has_lease()) {
                ++leases_;
                leases_.notify_all();
                if (options_.hold || !options_.problem.empty()) {
                    continue;
                }
                if (options_.stall_after >= 0 && results >= options_.stall_after) {
                    continue;
                }
                if (results == options_.die_after) {
                    context_.TryCancel();
                    break;
                }
                if (message.lease().keep_samples()) {
                    stream->Write(Samples(message.lease(), results < options_.short_until));
                }
                v1::Lease lease = message.lease();
                if (results < options_.misread_until) {
                    lease.set_first_sample(0, lease.first_sample(0) ^ 2);
                }
                v1::WorkRequest answer = Render(contexts.at(lease.job()), lease,
                                                results < options_.wrong_until, options_.odd);
                if (results < options_.garbled_until) {
                    // The lowest bit of a mean: a result like any other.
                    std::string* planes = answer.mutable_result()->mutable_planes();
                    char& byte = (*planes)[kMeanA * planes->size() / kFilmChannelCount];
                    byte = static_cast<char>(byte ^ 1);
                }
                stream->Write(answer);
                ++results;
            } else if (message.has_revoke()) {
                revoked_ += message.revoke().lease_ids_size();
            } else if (message.has_acknowledge()) {
                acknowledged_ += message.acknowledge().tickets_size();
                acknowledged_.notify_all();
            } else if (message.has_job_over()) {
                ++jobs_over_;
                jobs_over_.notify_all();
            } else if (message.has_drain()) {
                drained_ = true;
                stream->WritesDone();
            }
        }
        status_ = stream->Finish();
        ended_ = true;
        ended_.notify_all();
    }

  public:
    // `context`: of the lease's job.
    static v1::WorkRequest Render(const v1::JobContext& context, const v1::Lease& lease, bool wrong,
                                  bool odd = false) {
        const TileTask task = codec::TaskFromLease(lease);
        TileResult tile = PseudoRender(task);
        if (wrong) {
            tile.planes[0] += 1;
        }
        if (odd) {
            tile.planes[kMeanA * tile.pixels.size()] += 0.125F;
        }
        v1::WorkRequest message;
        v1::LeaseResult* result = message.mutable_result();
        result->set_lease_id(lease.id());
        result->set_job(lease.job());
        result->set_planes(codec::EncodePlanes(tile));
        result->set_rays(tile.rays);
        result->set_seconds(tile.seconds);
        result->set_epoch(lease.epoch());
        result->set_unit(lease.unit());
        if (lease.keep_samples()) {
            tile.samples = PseudoRecords(task);
        }
        const std::uint64_t digest = codec::ContextDigest(
            context.job(), codec::FromProto(context.scene()), codec::FromProto(context.settings()));
        codec::SetDigests(codec::TaskDigest(digest, lease.unit(), task), tile, result);
        if (!lease.keep_samples()) {
            result->set_ticket(lease.ticket());
        }
        return message;
    }

  private:
    static std::vector<SampleRecord> PseudoRecords(const TileTask& task) {
        std::vector<SampleRecord> records;
        for (std::uint32_t i = 0; i < task.count.size(); ++i) {
            const auto at = static_cast<int>(i);
            for (std::uint32_t s = 0; s < task.count[i]; ++s) {
                const PixelSample sample =
                    PseudoSample(task.rect.x0 + at % task.rect.width(),
                                 task.rect.y0 + at / task.rect.width(), task.first[i] + s);
                records.push_back(IsFinite(sample.radiance) ? SampleRecord{} : SampleRecord::Bad());
            }
        }
        return records;
    }
    static v1::WorkRequest Samples(const v1::Lease& lease, bool one_less) {
        const std::vector<SampleRecord> records = PseudoRecords(codec::TaskFromLease(lease));
        v1::WorkRequest message;
        message.mutable_samples()->set_lease_id(lease.id());
        message.mutable_samples()->set_data(
            reinterpret_cast<const char*>(records.data()),
            (records.size() - (one_less ? 1 : 0)) * sizeof(SampleRecord));
        return message;
    }

    FakeWorkerOptions options_;
    std::unique_ptr<v1::WorkerService::Stub> stub_;
    grpc::ClientContext context_;
    std::atomic<int> leases_{0}, revoked_{0}, jobs_over_{0}, acknowledged_{0};
    std::atomic<bool> drained_{false}, ended_{false};
    grpc::Status status_;
    std::thread thread_;
};

}  // namespace relume::server
