#pragma once

#include <algorithm>
#include <chrono>
#include <mutex>
#include <random>
#include <thread>

#include "client/lib/client.h"

// What Client's own files share: its calls, and how often they are tried.
namespace relume::client {

inline constexpr double kUnarySeconds = 20;

// Of a call that came to nothing because its connection did. The second is what a server that stops
// says to what comes in at its last moment, the third what gRPC says of a connection that broke by
// bytes that are not what TLS makes of them.
inline bool MayPass(const grpc::Status& status) {
    return status.error_code() == grpc::StatusCode::UNAVAILABLE ||
           status.error_code() == grpc::StatusCode::CANCELLED ||
           (status.error_code() == grpc::StatusCode::UNKNOWN &&
            status.error_message() == "Stream removed");
}

// A call's context, known to Interrupt while it lives.
class Client::CallContext {
  public:
    // `seconds` 0: no deadline.
    CallContext(Client* client, double seconds) : client_(client) {
        if (seconds > 0) {
            context_.set_deadline(std::chrono::system_clock::now() +
                                  std::chrono::milliseconds(static_cast<int>(seconds * 1000)));
        }
        const std::lock_guard lock(client_->mutex_);
        client_->current_ = &context_;
        if (client_->interrupted_) {
            context_.TryCancel();
        }
    }
    ~CallContext() {
        const std::lock_guard lock(client_->mutex_);
        client_->current_ = nullptr;
    }
    CallContext(const CallContext&) = delete;
    CallContext& operator=(const CallContext&) = delete;

    grpc::ClientContext* get() { return &context_; }

  private:
    Client* client_;
    grpc::ClientContext context_;
};

// How long and how often a call that the server may not have got is tried again.
class Client::Retry {
  public:
    explicit Retry(Client* client, double patience = kPatienceSeconds)
        : client_(client), patience_(patience) {}

    // The call gets on: patience starts anew.
    void Progress() {
        client_->reached_ = true;
        since_ = std::chrono::steady_clock::now();
        backoff_ = kFirstBackoff;
    }

    // Waits before the next attempt of a call that failed with `status`; throws if it is not worth
    // one.
    void Wait(const grpc::Status& status) {
        using Seconds = std::chrono::duration<double>;
        const double patience = client_->reached_ ? patience_ : kFirstContactSeconds;
        if (client_->interrupted_ || !MayPass(status) ||
            Seconds(std::chrono::steady_clock::now() - since_).count() >= patience) {
            client_->Throw(status);
        }
        static thread_local std::mt19937 random(std::random_device{}());
        Pause(Seconds(backoff_ * std::uniform_real_distribution<>(0.5, 1.5)(random)));
        backoff_ = std::min(2 * backoff_, 2.0);
    }

  private:
    static constexpr double kFirstBackoff = 0.1;                  // seconds
    static constexpr auto kStep = std::chrono::milliseconds(50);  // between looks at interrupted_

    // A connection comes about only while one of our threads waits on its channel: one that slept
    // between its calls, which fail at once, would never see TLS's handshake end.
    void Pause(std::chrono::duration<double> length) {
        using Clock = std::chrono::steady_clock;
        const auto end = Clock::now() + std::chrono::duration_cast<Clock::duration>(length);
        while (!client_->interrupted_ && Clock::now() < end) {
            const auto step = std::min<Clock::duration>(kStep, end - Clock::now());
            if (client_->channel_->WaitForConnected(std::chrono::system_clock::now() + step)) {
                std::this_thread::sleep_for(step);  // it is the server that asks for patience
            }
        }
    }

    Client* client_;
    const double patience_;
    std::chrono::steady_clock::time_point since_ = std::chrono::steady_clock::now();
    double backoff_ = kFirstBackoff;
};

}  // namespace relume::client
