#pragma once

#include <cstddef>
#include <cstdint>
#include <map>
#include <string>
#include <vector>

#include "relume/v1/work.pb.h"

namespace relume::worker {

// Answers that the server has not acknowledged: it may die, and start again without them. The
// oldest go first when they become too many: they will be rendered again if they are missed. Not
// thread-safe.
class KeptResults {
  public:
    explicit KeptResults(std::size_t max_bytes) : max_bytes_(max_bytes) {}

    // `message` holds a LeaseResult with a ticket; it replaces one with the same.
    void Keep(const v1::WorkRequest& message);
    void Drop(const std::string& ticket);
    // Oldest first.
    std::vector<v1::WorkRequest> All() const;

    std::size_t bytes() const { return bytes_; }

  private:
    std::size_t max_bytes_;
    std::size_t bytes_ = 0;
    std::uint64_t last_ = 0;
    std::map<std::uint64_t, v1::WorkRequest> results_;  // by age
    std::map<std::string, std::uint64_t> by_ticket_;
};

}  // namespace relume::worker
