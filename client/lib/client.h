#pragma once

#include <grpcpp/channel.h>
#include <grpcpp/client_context.h>

#include <atomic>
#include <cstdint>
#include <functional>
#include <memory>
#include <mutex>
#include <string>
#include <vector>

#include "client/lib/output_file.h"
#include "client/lib/scene_files.h"
#include "core/trust/tls_files.h"
#include "relume/v1/blobs.grpc.pb.h"
#include "relume/v1/jobs.grpc.pb.h"

namespace relume::client {

// A server and what to show it.
struct Endpoint {
    std::string address;  // HOST:PORT
    TlsPems tls;
};

// A client of one server. Every call has a deadline or, where it waits for a job, comes back after
// Interrupt. Failures are Errors with a line for a person; kUnavailable means that the server can't
// be reached, kUnauthenticated that TLS is why. One thread uses it; Interrupt may come from any.
class Client {
  public:
    explicit Client(const Endpoint& server);

    // Uploads what the server lacks, again if it arrives damaged (kUploadAttempts in all).
    // `progress` gets the bytes done and due so far.
    void UploadScene(const LocalScene& scene,
                     const std::function<void(std::uint64_t, std::uint64_t)>& progress);

    // Asks the server what it thinks of a job without making one. A scene whose files are not there
    // yet is no objection.
    void Validate(const v1::JobSpec& spec);
    // Makes the job. Safe to repeat within: the request carries an id. kDataLoss if the server has
    // understood another one.
    v1::Job Create(const v1::JobSpec& spec);

    v1::Job Get(const std::string& name);
    // `discard`: no image is made of what is there.
    v1::Job Cancel(const std::string& name, bool discard);
    v1::Job Pause(const std::string& name);
    // Of a paused job.
    v1::Job Continue(const std::string& name);
    v1::Job SetPriority(const std::string& name, int priority);
    // Makes a job that has an image go on to `spp` samples a pixel.
    v1::Job Extend(const std::string& name, double spp);
    // Newest first, at most `limit`; with a group's name its jobs alone.
    std::vector<v1::Job> List(std::size_t limit, const std::string& group = "");
    std::vector<v1::Worker> Workers();
    // Ends a worker's quarantine.
    void Release(const std::string& worker);

    // Calls `on_event` for each event until the job is over; answers with the job. A broken
    // connection is taken up again at the next event; a server that stays away for
    // kWatchPatienceSeconds is an error.
    v1::Job Watch(const std::string& name, const std::function<void(const v1::Job&)>& on_event);

    // Appends the job's result to `file`, going on where a broken connection left off; checks its
    // SHA-256. `file` is not committed.
    void Fetch(const std::string& name, OutputFile* file);

    // Makes the call under way, and all later ones, end with kCancelled until Resume.
    void Interrupt();
    void Resume() { interrupted_ = false; }

    const std::string& server() const { return server_.address; }

    static constexpr int kUploadAttempts = 3;
    static constexpr double kPatienceSeconds = 30;
    static constexpr double kWatchPatienceSeconds = 600;  // it may be restarted meanwhile
    // For a server that has not answered once: the address is wrong, or nothing runs there.
    static constexpr double kFirstContactSeconds = 4;

  private:
    class CallContext;
    class Retry;
    [[noreturn]] void Throw(const grpc::Status& status) const;
    // Throws unless the call went well.
    void Require(const grpc::Status& status);
    // A call that may be made twice, tried again while the server is away.
    void Insist(const std::function<grpc::Status(grpc::ClientContext*)>& call);
    void UploadBlob(const std::string& sha256, std::uint64_t size, std::uint64_t offset,
                    const std::string& path, const std::function<void(std::uint64_t)>& progress);

    const Endpoint server_;
    std::shared_ptr<grpc::Channel> channel_;
    std::unique_ptr<v1::JobService::Stub> jobs_;
    std::unique_ptr<v1::BlobService::Stub> blobs_;

    bool reached_ = false;  // the server has answered
    std::atomic<bool> interrupted_{false};
    std::mutex mutex_;                        // guards all below
    grpc::ClientContext* current_ = nullptr;  // of the call under way
};

}  // namespace relume::client
