#pragma once

#include <cstdint>
#include <map>

namespace relume::jobs {

// The memory that jobs take from their start to their end, bytes, and how much of it there may be.
class MemoryRoom {
  public:
    void SetMost(std::uint64_t most) { most_ = most; }
    // What a job takes from now on; 0: nothing. Whether that is less than before.
    bool Put(std::uint64_t job, std::uint64_t bytes);
    // Whether there is room for so many more. Always if nobody takes any: a job that is larger than
    // all there may be runs alone.
    bool Has(std::uint64_t bytes) const { return taken_ == 0 || bytes <= Left(); }

  private:
    std::uint64_t Left() const { return taken_ < most_ ? most_ - taken_ : 0; }

    std::uint64_t most_ = ~std::uint64_t{0}, taken_ = 0;
    std::map<std::uint64_t, std::uint64_t> of_;  // by job
};

}  // namespace relume::jobs
