#pragma once

#include <cstdint>
#include <map>
#include <mutex>
#include <optional>
#include <string>

namespace relume::server {

// How long images took to be filtered and encoded, by filter: what time limits leave room for.
// Thread-safe.
class FinishTimes {
  public:
    void Add(const std::string& filter, std::uint64_t pixels, double seconds);
    // Nothing before the first one.
    std::optional<double> Predict(const std::string& filter, std::uint64_t pixels) const;

  private:
    mutable std::mutex mutex_;
    std::map<std::string, double> seconds_per_pixel_;  // guarded by mutex_
};

}  // namespace relume::server
