#pragma once

#include <algorithm>
#include <atomic>
#include <cstdint>
#include <vector>

#include "core/scene/scene.h"

namespace relume {

// Bytes that a scene's arrays may take: a file of a few megabytes can ask for any number (accessors
// over one buffer, patches over four vertices, instances). What is about to be made is counted
// first. Thread-safe. `where` of each method gives the place that a refusal names.
class ArrayRoom {
  public:
    // 0: half of what this process may take, of its machine's memory or its own limit (LimitData).
    explicit ArrayRoom(std::uint64_t most = 0);

    ArrayRoom(const ArrayRoom& other) : most_(other.most_), taken_(other.taken_.load()) {}

    // Throws kResourceExhausted if all together are too many then.
    template <class Where>
    void Take(std::uint64_t bytes, const Where& where) {
        if (bytes > most_ || (taken_ += bytes) > most_) {
            Refuse(where());
        }
    }
    void Release(std::uint64_t bytes) { taken_ -= bytes; }

    // Before an element is appended: counts what the array grows by, which doubles it.
    template <class T, class Where>
    void ForOneMore(const std::vector<T>& array, const Where& where) {
        if (array.size() == array.capacity()) {
            Take(std::max<std::size_t>(array.capacity(), 1) * sizeof(T), where);
        }
    }
    template <class T, class Where>
    void Reserve(std::vector<T>* array, std::size_t size, const Where& where) {
        if (size > array->capacity()) {
            // Not the bytes, which may be more than 64 bits hold.
            Take(size - array->capacity() > most_ / sizeof(T)
                     ? most_ + 1
                     : (size - array->capacity()) * sizeof(T),
                 where);
            array->reserve(size);
        }
    }

  private:
    [[noreturn]] void Refuse(const SourceLocation& where) const;

    const std::uint64_t most_;
    std::atomic<std::uint64_t> taken_{0};
};

}  // namespace relume
