#pragma once

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <utility>
#include <vector>

#include "core/base/byte_stream.h"
#include "core/base/error.h"

namespace relume::jobs {

// A number of samples for each pixel, row-major. Where all are equal, as in uniform passes, they
// take no memory.
class PixelCounts {
  public:
    PixelCounts() = default;
    PixelCounts(std::vector<std::uint32_t> counts)  // NOLINT: what they are
        : size_(counts.size()), counts_(std::move(counts)) {
        if (size_ > 0 && std::all_of(counts_.begin(), counts_.end(),
                                     [&](std::uint32_t c) { return c == counts_[0]; })) {
            count_ = counts_[0];
            std::vector<std::uint32_t>().swap(counts_);  // gives the memory back
        }
    }

    std::size_t size() const { return size_; }
    bool empty() const { return size_ == 0; }
    std::uint32_t operator[](std::size_t i) const { return counts_.empty() ? count_ : counts_[i]; }
    friend bool operator==(const PixelCounts&, const PixelCounts&) = default;

    void Put(ByteWriter* out) const {
        out->Put<std::uint64_t>(size_);
        out->Put(count_);
        out->PutAll(counts_);
    }
    // Throws kDataLoss for bytes of something else.
    static PixelCounts Get(ByteReader* in) {
        PixelCounts counts;
        counts.size_ = in->Get<std::uint64_t>();
        counts.count_ = in->Get<std::uint32_t>();
        counts.counts_ = in->GetAll<std::uint32_t>();
        if (!counts.counts_.empty() && counts.counts_.size() != counts.size_) {
            throw Error(ErrorCode::kDataLoss, "saved counts are too few");
        }
        return counts;
    }

  private:
    std::size_t size_ = 0;
    std::uint32_t count_ = 0;            // of each pixel, if
    std::vector<std::uint32_t> counts_;  // this is empty
};

}  // namespace relume::jobs
