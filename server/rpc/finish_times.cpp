#include "server/rpc/finish_times.h"

namespace relume::server {
namespace {

constexpr double kNewestWeight = 0.5;

}  // namespace

void FinishTimes::Add(const std::string& filter, std::uint64_t pixels, double seconds) {
    if (pixels == 0) {
        return;
    }
    const double each = seconds / static_cast<double>(pixels);
    const std::lock_guard lock(mutex_);
    const auto [it, first] = seconds_per_pixel_.emplace(filter, each);
    if (!first) {
        it->second += kNewestWeight * (each - it->second);
    }
}

std::optional<double> FinishTimes::Predict(const std::string& filter, std::uint64_t pixels) const {
    const std::lock_guard lock(mutex_);
    const auto it = seconds_per_pixel_.find(filter);
    return it == seconds_per_pixel_.end() ? std::nullopt
                                          : std::optional(it->second * static_cast<double>(pixels));
}

}  // namespace relume::server
