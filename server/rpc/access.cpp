#include "server/rpc/access.h"

#include <fmt/format.h>
#include <grpc/grpc_security_constants.h>

#include <algorithm>
#include <cstring>
#include <vector>

#include "core/base/error.h"
#include "core/base/log.h"
#include "core/trust/join_token.h"
#include "server/rpc/status.h"

namespace relume::server {
namespace {

constexpr std::size_t kMaxName = 200;

// A certificate's words in one line that can be shown in a terminal.
std::string Clean(std::string_view text) {
    std::string clean(text.substr(0, kMaxName));
    std::replace_if(
        clean.begin(), clean.end(), [](char c) { return c < ' ' || c > '~'; }, '?');
    return clean;
}

std::string CommonName(const grpc::AuthContext& caller) {
    const auto names = caller.FindPropertyValues(GRPC_X509_CN_PROPERTY_NAME);
    return names.empty() ? "" : Clean({names.front().data(), names.front().size()});
}

std::vector<Role> RolesOf(const grpc::AuthContext& caller) {
    std::vector<Role> roles;
    if (caller.IsPeerAuthenticated()) {
        for (const grpc::string_ref& uri : caller.FindPropertyValues(GRPC_PEER_URI_PROPERTY_NAME)) {
            if (const auto role = RoleOfUri({uri.data(), uri.size()})) {
                roles.push_back(*role);
            }
        }
    }
    return roles;
}

template <typename Roles>
std::string Join(const Roles& roles, const char* between) {
    std::string text;
    for (const Role role : roles) {
        text += (text.empty() ? "" : between) + std::string(ToString(role));
    }
    return text;
}

grpc::Status Refusal(ErrorCode code, const grpc::CallbackServerContext& context,
                     const std::string& message) {
    spdlog::warn("refused {}: {}", context.peer(), message);
    return ToStatus(Error(code, message));
}

}  // namespace

const char* ToString(Role role) {
    switch (role) {
        case Role::kWorker:
            return "worker";
        case Role::kClient:
            return "client";
        case Role::kOperator:
            return "operator";
        case Role::kAdmin:
            break;
    }
    return "admin";
}

std::optional<Role> RoleOfUri(std::string_view uri) {
    constexpr std::string_view kScheme = "spiffe://", kPath = "/relume/";
    if (uri.substr(0, kScheme.size()) != kScheme) {
        return std::nullopt;
    }
    uri.remove_prefix(kScheme.size());
    const std::size_t domain = uri.find('/');
    if (domain == 0 || domain == std::string_view::npos ||
        uri.substr(domain, kPath.size()) != kPath) {
        return std::nullopt;
    }
    uri.remove_prefix(domain + kPath.size());
    for (const Role role : {Role::kWorker, Role::kClient, Role::kOperator, Role::kAdmin}) {
        if (uri == ToString(role)) {
            return role;
        }
    }
    return std::nullopt;
}

std::string HostOfPeer(const std::string& peer) {
    const std::size_t begin = peer.find(':') + 1, end = peer.rfind(':');
    return Clean(begin > 0 && end >= begin ? peer.substr(begin, end - begin) : peer);
}

std::string OwnerOf(const grpc::CallbackServerContext& context, std::string_view said) {
    constexpr std::size_t kMaxOwner = 64;
    const auto caller = context.auth_context();
    std::string owner;
    if (caller && caller->IsPeerAuthenticated()) {
        owner = CommonName(*caller);
    }
    if (owner.empty() && !said.empty()) {
        return Clean(said);  // too long a one is the caller's to mend
    }
    if (owner.empty()) {
        owner = HostOfPeer(context.peer());
    }
    return owner.substr(0, kMaxOwner);
}

grpc::Status Access::CheckRole(const grpc::CallbackServerContext& context,
                               std::initializer_list<Role> allowed) const {
    if (!roles_) {
        return grpc::Status::OK;
    }
    const auto caller = context.auth_context();
    const std::vector<Role> roles = RolesOf(*caller);
    for (const Role role : roles) {
        const auto may = [&](Role as) {
            return std::find(allowed.begin(), allowed.end(), as) != allowed.end();
        };
        if (role == Role::kAdmin || may(role) || (role == Role::kOperator && may(Role::kClient))) {
            return grpc::Status::OK;
        }
    }
    return Refusal(
        ErrorCode::kPermissionDenied, context,
        fmt::format("the certificate '{}' is {}, and this call is for {}; use a certificate "
                    "with the URI name spiffe://DOMAIN/relume/{} (deploy/certs makes them)",
                    CommonName(*caller),
                    roles.empty() ? "of no role" : "a " + Join(roles, " and ") + "'s",
                    Join(allowed, "s and ") + "s", Join(allowed, " or .../")));
}

grpc::Status Access::CheckToken(const grpc::CallbackServerContext& context) const {
    if (join_token_.empty()) {
        return grpc::Status::OK;
    }
    const auto& metadata = context.client_metadata();
    const auto [begin, end] = metadata.equal_range(kJoinTokenKey);
    if (begin == end) {
        return Refusal(ErrorCode::kUnauthenticated, context,
                       "this server takes on workers with its join token alone; start the worker "
                       "with --join-token FILE");
    }
    if (!SameToken(join_token_, {begin->second.data(), begin->second.size()})) {
        return Refusal(ErrorCode::kUnauthenticated, context,
                       "the worker's join token is not this server's; give both the same by "
                       "--join-token FILE");
    }
    return grpc::Status::OK;
}

grpc::Status Access::CountStream(const grpc::CallbackServerContext& context,
                                 StreamLimit::Slot* slot) const {
    *slot = streams_.Take(HostOfPeer(context.peer()));
    return *slot ? grpc::Status::OK
                 : Refusal(ErrorCode::kResourceExhausted, context,
                           fmt::format("your address has {} streams open; close some, or ask for a "
                                       "larger --client-streams",
                                       streams_.most()));
}

void Access::CheckOwner(const grpc::CallbackServerContext& context, const std::string& job,
                        const std::string& owner) const {
    if (!roles_) {
        return;
    }
    const auto caller = context.auth_context();
    for (const Role role : RolesOf(*caller)) {
        if (role == Role::kAdmin || role == Role::kOperator) {
            return;
        }
    }
    if (const std::string name = OwnerOf(context, ""); name != owner) {
        const std::string message = fmt::format(
            "{} is of '{}', and the certificate is of '{}'; ask its owner, or use a certificate "
            "with the URI name spiffe://DOMAIN/relume/operator",
            job, owner, name);
        spdlog::warn("refused {}: {}", context.peer(), message);
        throw Error(ErrorCode::kPermissionDenied, message);
    }
}

void LogGrpcMessage(const char* message) {
    if (std::strstr(message, "Handshake failed") != nullptr) {
        spdlog::warn("refused a connection: {}", message);
    } else {
        spdlog::debug("gRPC: {}", message);
    }
}

}  // namespace relume::server
