#pragma once

#include <grpcpp/server_context.h>
#include <grpcpp/support/server_callback.h>

#include <initializer_list>
#include <optional>
#include <string>
#include <string_view>
#include <utility>

#include "server/rpc/stream_limit.h"

namespace relume::server {

// What a caller's certificate says that it is.
enum class Role { kWorker, kClient, kOperator, kAdmin };

// "worker", ...
const char* ToString(Role role);

// By a certificate's URI name, spiffe://TRUST-DOMAIN/relume/ROLE; nothing for any other. The trust
// domain is not looked at: the server's CA is believed.
std::optional<Role> RoleOfUri(std::string_view uri);

// Whose job it is: by the name of the caller's certificate; without one what the caller `said`,
// else its address without the port. In one line that can be shown in a terminal.
std::string OwnerOf(const grpc::CallbackServerContext& context, std::string_view said);

// The host of gRPC's name for a caller: 10.0.0.7 of "ipv4:10.0.0.7:4711"; any other name as it is.
std::string HostOfPeer(const std::string& peer);

// Who is let in to what. Thread-safe.
class Access {
  public:
    // `roles`: callers come with certificates, and each call is for some roles alone; else for
    // everybody. `join_token`: workers show this one, too, or "": none is asked for.
    // `streams`: most that one address may have open.
    Access(bool roles, std::string join_token, std::size_t streams)
        : roles_(roles), join_token_(std::move(join_token)), streams_(streams) {}

    // A reactor that ends the call if its caller has none of the `allowed` roles, and null if it
    // has; an operator may call what a client may, an admin everything. A refusal is logged with
    // the caller's address and name.
    template <typename Reactor>
    Reactor* Refuse(grpc::CallbackServerContext* context,
                    std::initializer_list<Role> allowed) const {
        const grpc::Status status = CheckRole(*context, allowed);
        return status.ok() ? nullptr : new Refused<Reactor>(status);
    }
    // The same for a worker's stream, with the join token.
    template <typename Reactor>
    Reactor* RefuseWorker(grpc::CallbackServerContext* context) const {
        grpc::Status status = CheckRole(*context, {Role::kWorker});
        status = status.ok() ? CheckToken(*context) : status;
        return status.ok() ? nullptr : new Refused<Reactor>(status);
    }
    // The same if the caller's address has too many streams open. Else the stream counts until
    // `slot` is let go.
    template <typename Reactor>
    Reactor* RefuseStream(grpc::CallbackServerContext* context, StreamLimit::Slot* slot) const {
        const grpc::Status status = CountStream(*context, slot);
        return status.ok() ? nullptr : new Refused<Reactor>(status);
    }

    // Throws kPermissionDenied unless the caller may change a job of `owner`'s: where roles are
    // asked for that is the owner itself, an operator or an admin, else everybody.
    void CheckOwner(const grpc::CallbackServerContext& context, const std::string& job,
                    const std::string& owner) const;

  private:
    // Says no and deletes itself.
    template <typename Reactor>
    class Refused final : public Reactor {
      public:
        explicit Refused(const grpc::Status& status) { this->Finish(status); }
        void OnDone() override { delete this; }
    };

    grpc::Status CheckRole(const grpc::CallbackServerContext& context,
                           std::initializer_list<Role> allowed) const;
    grpc::Status CheckToken(const grpc::CallbackServerContext& context) const;
    grpc::Status CountStream(const grpc::CallbackServerContext& context,
                             StreamLimit::Slot* slot) const;

    const bool roles_;
    const std::string join_token_;
    const StreamLimit streams_;
};

// Takes what gRPC has to say: TLS handshakes that failed, which it tells of nowhere else, are
// logged as warnings, the rest, which is for its developers, at debug level.
void LogGrpcMessage(const char* message);

}  // namespace relume::server
