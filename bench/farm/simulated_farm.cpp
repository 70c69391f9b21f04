#include "bench/farm/simulated_farm.h"

#include <fmt/format.h>
#include <grpcpp/create_channel.h>
#include <grpcpp/security/credentials.h>
#include <grpcpp/support/client_callback.h>

#include <algorithm>
#include <map>
#include <set>
#include <utility>

#include "proto/codec/codec.h"
#include "proto/codec/digests.h"
#include "proto/codec/protocol.h"

namespace relume::bench {
namespace {

using Stub = grpc::TemplatedGenericStub<grpc::ByteBuffer, v1::WorkResponse>;

double Seconds(Clock::duration d) { return std::chrono::duration<double>(d).count(); }

grpc::ByteBuffer ToBuffer(const v1::WorkRequest& message) {
    const grpc::Slice slice(message.SerializeAsString());
    return {&slice, 1};
}

}  // namespace

// One stream on a connection of its own.
class SimulatedFarm::Worker final
    : public grpc::ClientBidiReactor<grpc::ByteBuffer, v1::WorkResponse> {
  public:
    Worker(SimulatedFarm* farm, int index) : farm_(farm) {
        grpc::ChannelArguments arguments;
        arguments.SetInt(GRPC_ARG_USE_LOCAL_SUBCHANNEL_POOL, 1);
        const auto channel = grpc::CreateCustomChannel(
            farm->options_.server, grpc::InsecureChannelCredentials(), arguments);
        stub_ = std::make_unique<Stub>(channel);
        stub_->PrepareBidiStreamingCall(&context_, "/relume.v1.WorkerService/Work", {}, this);
        v1::WorkRequest message;
        auto* hello = message.mutable_hello();
        hello->set_name(fmt::format("simulated-{}", index));
        hello->set_protocol_version(kProtocolVersion);
        hello->mutable_numeric_class()->set_build(kBuild);
        hello->mutable_numeric_class()->set_isa(farm->options_.isa);
        hello->set_threads(1);
        AddHold();
        Send(ToBuffer(message));
        StartRead(&incoming_);
        StartCall();
    }
    ~Worker() override {
        context_.TryCancel();
        std::unique_lock lock(mutex_);
        done_changed_.wait(lock, [&] { return done_; });
    }

    void Send(grpc::ByteBuffer message) {
        const std::lock_guard lock(mutex_);
        if (!broken_) {
            outbox_.push_back(std::move(message));
            WriteNext();
        }
    }
    void Answer(grpc::ByteBuffer message) {
        {
            const std::lock_guard lock(mutex_);
            left_.push_back(Clock::now());
        }
        Send(std::move(message));
    }
    void Report() {
        v1::WorkRequest message;
        message.mutable_report()->set_credits(static_cast<std::uint32_t>(farm_->options_.credits));
        message.mutable_report()->set_leases_held(held_);
        Send(ToBuffer(message));
    }
    void Answered() { --held_; }
    // Nobody waits for the answer to this lease any more.
    bool TakeRevoked(std::uint64_t lease) {
        const std::lock_guard lock(mutex_);
        return revoked_.erase(lease) > 0;
    }

    void OnReadDone(bool ok) override {
        if (!ok) {
            Break();
            return;
        }
        switch (incoming_.message_case()) {
            case v1::WorkResponse::kWelcome:
                Report();
                break;
            case v1::WorkResponse::kJob: {
                const v1::JobContext& context = incoming_.job();
                context_digests_[context.job()] =
                    codec::ContextDigest(context.job(), codec::FromProto(context.scene()),
                                         codec::FromProto(context.settings()));
                v1::WorkRequest message;
                message.mutable_scene_ready()->set_job(context.job());
                Send(ToBuffer(message));
                break;
            }
            case v1::WorkResponse::kLease:
                Take(std::make_shared<v1::Lease>(std::move(*incoming_.mutable_lease())));
                break;
            case v1::WorkResponse::kRevoke: {
                const auto& ids = incoming_.revoke().lease_ids();
                const std::lock_guard lock(mutex_);
                revoked_.insert(ids.begin(), ids.end());
                break;
            }
            default:
                break;  // answers are not kept, so that nothing is to be dropped
        }
        incoming_.Clear();
        StartRead(&incoming_);
    }
    void OnWriteDone(bool ok) override {
        {
            const std::lock_guard lock(mutex_);
            writing_ = false;
            if (ok) {
                WriteNext();
            }
        }
        if (!ok) {
            Break();
        }
    }
    void OnDone(const grpc::Status& status) override {
        farm_->Ended(status.error_message());
        const std::lock_guard lock(mutex_);
        done_ = true;
        done_changed_.notify_all();
    }

  private:
    void Take(std::shared_ptr<v1::Lease> lease) {
        const auto now = Clock::now();
        ++held_;
        {
            const std::lock_guard lock(mutex_);
            if (!left_.empty()) {
                farm_->Arrived(Seconds(now - left_.front()));
                left_.pop_front();
            }
        }
        const TileTask task = codec::TaskFromLease(*lease);
        const std::uint64_t digest =
            codec::TaskDigest(context_digests_.at(lease->job()), lease->unit(), task);
        const double speed = farm_->options_.samples_per_second;
        const double seconds = static_cast<double>(task.TotalSamples()) / (speed > 0 ? speed : 1e9);
        if (speed > 0) {
            free_ = std::max(free_, now) + std::chrono::duration_cast<Clock::duration>(
                                               std::chrono::duration<double>(seconds));
        } else {
            free_ = now;
        }
        const std::lock_guard lock(farm_->mutex_);
        farm_->due_.push({free_, this, std::move(lease), digest, seconds});
        farm_->due_changed_.notify_one();
    }
    // With mutex_ held.
    void WriteNext() {
        if (!writing_ && !broken_ && !outbox_.empty()) {
            outgoing_ = std::move(outbox_.front());
            outbox_.pop_front();
            writing_ = true;
            StartWrite(&outgoing_);
        }
    }
    void Break() {
        {
            const std::lock_guard lock(mutex_);
            if (std::exchange(broken_, true)) {
                return;
            }
            outbox_.clear();
        }
        RemoveHold();
    }

    SimulatedFarm* farm_;
    grpc::ClientContext context_;
    std::unique_ptr<Stub> stub_;
    v1::WorkResponse incoming_;
    std::map<std::string, std::uint64_t> context_digests_;
    Clock::time_point free_{};  // when it is through with what it holds
    std::atomic<std::uint32_t> held_{0};

    std::mutex mutex_;  // guards all below
    std::condition_variable done_changed_;
    std::deque<grpc::ByteBuffer> outbox_;
    grpc::ByteBuffer outgoing_;
    std::deque<Clock::time_point> left_;  // results, whose place is free
    std::set<std::uint64_t> revoked_;     // leases in hand
    bool writing_ = false, broken_ = false, done_ = false;
};

SimulatedFarm::SimulatedFarm(const SimulatedFarmOptions& options)
    : options_(options), answers_(options.noisy) {
    for (int i = 0; i < options.workers; ++i) {
        workers_.push_back(std::make_unique<Worker>(this, i));
    }
    thread_ = std::thread([this] { AnswerThread(); });
}

SimulatedFarm::~SimulatedFarm() {
    {
        const std::lock_guard lock(mutex_);
        stopping_ = true;
    }
    due_changed_.notify_one();
    thread_.join();
    workers_.clear();
}

Work SimulatedFarm::Take() {
    const std::lock_guard lock(mutex_);
    return std::exchange(work_, {});
}

std::string SimulatedFarm::why() const {
    const std::lock_guard lock(mutex_);
    return why_;
}

void SimulatedFarm::AnswerThread() {
    auto next_report = Clock::now();
    std::unique_lock lock(mutex_);
    while (!stopping_) {
        const auto now = Clock::now();
        if (now >= next_report) {
            next_report = now + std::chrono::duration_cast<Clock::duration>(
                                    std::chrono::duration<double>(kReportSeconds));
            lock.unlock();
            for (const auto& worker : workers_) {
                worker->Report();
            }
            lock.lock();
        } else if (due_.empty() || due_.top().at > now) {
            const auto until = due_.empty() ? next_report : std::min(next_report, due_.top().at);
            due_changed_.wait_until(lock, until);
        } else {
            const Due due = due_.top();
            due_.pop();
            lock.unlock();
            if (due.worker->TakeRevoked(due.lease->id())) {
                due.worker->Answered();
                lock.lock();
                continue;
            }
            grpc::ByteBuffer answer = answers_.AnswerTo(*due.lease, due.task_digest, due.seconds);
            Answered(due, answer.Length());
            due.worker->Answered();
            due.worker->Answer(std::move(answer));
            lock.lock();
        }
    }
}

void SimulatedFarm::Answered(const Due& due, std::size_t bytes) {
    const v1::Lease& lease = *due.lease;
    const TileTask task = codec::TaskFromLease(lease);
    const std::lock_guard lock(mutex_);
    ++work_.leases;
    work_.records += task.ActivePixels();
    work_.samples += task.TotalSamples();
    work_.bytes += bytes;
}

void SimulatedFarm::Arrived(double round_trip) {
    const std::lock_guard lock(mutex_);
    work_.round_trips.push_back(static_cast<float>(round_trip));
}

void SimulatedFarm::Ended(const std::string& why) {
    ++ended_;
    const std::lock_guard lock(mutex_);
    if (why_.empty() && !stopping_) {
        why_ = why;
    }
}

}  // namespace relume::bench
