#pragma once

#include <grpcpp/generic/generic_stub.h>

#include <atomic>
#include <chrono>
#include <condition_variable>
#include <cstdint>
#include <deque>
#include <memory>
#include <mutex>
#include <queue>
#include <string>
#include <thread>
#include <vector>

#include "bench/farm/answers.h"
#include "relume/v1/work.grpc.pb.h"

namespace relume::bench {

using Clock = std::chrono::steady_clock;

struct SimulatedFarmOptions {
    std::string server;  // HOST:PORT, without TLS
    std::string isa = "avx2";
    int workers = 100;
    double samples_per_second = 1e6;  // of each; 0: answers at once
    int credits = 3;                  // leases that each holds, as relume-worker's thread does
    double noisy = 1;                 // as in MakeUp
};

// What workers did in a span of time.
struct Work {
    std::uint64_t leases = 0, records = 0, samples = 0, bytes = 0;
    // Seconds from a result's leaving to the arrival of the lease that takes its place.
    std::vector<float> round_trips;
};

// Workers of one thread each that lease and answer over streams of their own, without tracing: a
// lease takes the time that its samples would. Thread-safe.
class SimulatedFarm {
  public:
    explicit SimulatedFarm(const SimulatedFarmOptions& options);
    // Closes all streams.
    ~SimulatedFarm();

    // What was done since the last call.
    Work Take();
    // Streams that have ended, and why the first did.
    int ended() const { return ended_; }
    std::string why() const;

  private:
    class Worker;
    struct Due {
        Clock::time_point at;
        Worker* worker;
        std::shared_ptr<v1::Lease> lease;
        std::uint64_t task_digest;
        double seconds;
        bool operator>(const Due& other) const { return at > other.at; }
    };

    void AnswerThread();
    void Answered(const Due& due, std::size_t bytes);
    void Arrived(double round_trip);
    void Ended(const std::string& why);

    const SimulatedFarmOptions options_;
    Answers answers_;
    std::atomic<int> ended_{0};

    mutable std::mutex mutex_;  // guards all below
    std::condition_variable due_changed_;
    std::priority_queue<Due, std::vector<Due>, std::greater<>> due_;
    Work work_;
    std::string why_;
    bool stopping_ = false;

    std::vector<std::unique_ptr<Worker>> workers_;
    std::thread thread_;
};

}  // namespace relume::bench
