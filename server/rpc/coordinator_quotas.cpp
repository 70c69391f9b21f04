#include <fmt/format.h>

#include "core/base/error.h"
#include "server/rpc/coordinator.h"

// Quotas of Coordinator: what one client may take of it.
namespace relume::server {
namespace {

constexpr std::size_t kOverJobsKept = 1000;  // with their results
// Of requests, which hold the names of the scenes' files: of one client's jobs that are not over,
// and of all jobs that are.
constexpr std::size_t kMaxClientBytes = std::size_t{64} << 20,
                      kMaxOverBytes = std::size_t{256} << 20;

[[noreturn]] void ThrowExhausted(const std::string& message) {
    throw Error(ErrorCode::kResourceExhausted, message);
}

}  // namespace

void Coordinator::CheckSize(const CheckedSpec& spec) const {
    const TileRect window = spec.settings.Window();
    if (static_cast<std::int64_t>(window.area()) > quotas_.pixels) {
        ThrowExhausted(
            fmt::format("{}x{} pixels: this server takes images of up to {} pixels; "
                        "choose a smaller --size or --crop, or ask for a larger "
                        "--max-pixels of the server",
                        window.width(), window.height(), quotas_.pixels));
    }
}

void Coordinator::CheckQuotas(const std::string& caller, std::size_t bytes) const {
    std::size_t all = 0, own = 0, own_bytes = bytes;
    for (const auto& [name, record] : records_) {
        if (record.over || jobs::IsOver(queue_.Get(name).state)) {
            continue;
        }
        ++all;
        if (record.caller == caller) {
            ++own;
            own_bytes += record.bytes;
        }
    }
    if (own >= quotas_.client_jobs) {
        ThrowExhausted(
            fmt::format("{} has {} jobs that are not over, the most of one client; wait "
                        "for some to end or cancel some, or ask for a larger "
                        "--client-jobs of the server",
                        caller, own));
    }
    if (all >= quotas_.jobs) {
        ThrowExhausted(
            fmt::format("the server has {} jobs that are not over, the most that it "
                        "takes; try again later, or ask for a larger --jobs",
                        all));
    }
    if (own_bytes > kMaxClientBytes) {
        ThrowExhausted(
            fmt::format("{} has jobs that are not over on so many scene files that "
                        "their names take {} MiB, with this one, {} are the most; wait "
                        "for some to end, or cancel some",
                        caller, own_bytes >> 20, kMaxClientBytes >> 20));
    }
}

void Coordinator::ForgetOldJobs() {
    const auto forget = [this](std::size_t keep) {
        for (const auto& name : queue_.ForgetOverJobs(keep)) {
            Forget(name);
        }
    };
    forget(kOverJobsKept);
    for (;;) {
        std::size_t over = 0, bytes = 0;
        for (const auto& [name, record] : records_) {
            if (record.over) {
                ++over;
                bytes += record.bytes;
            }
        }
        if (bytes <= kMaxOverBytes) {
            return;
        }
        forget(over / 2);
    }
}

}  // namespace relume::server
