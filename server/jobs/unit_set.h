#pragma once

#include <algorithm>
#include <cstddef>
#include <iterator>
#include <map>
#include <optional>

namespace relume::jobs {

// A set of numbers that are mostly runs: it takes memory for each run alone.
class UnitSet {
  public:
    std::size_t size() const { return size_; }
    void clear() {
        runs_.clear();
        size_ = 0;
    }
    // False if it is there already.
    bool Insert(std::size_t unit) {
        auto next = runs_.upper_bound(unit);
        const auto before = next == runs_.begin() ? runs_.end() : std::prev(next);
        if (before != runs_.end() && unit < before->second) {
            return false;
        }
        ++size_;
        std::size_t end = unit + 1;
        if (next != runs_.end() && next->first == end) {
            end = next->second;
            runs_.erase(next);
        }
        if (before != runs_.end() && before->second == unit) {
            before->second = end;
        } else {
            runs_.emplace(unit, end);
        }
        return true;
    }
    void Erase(std::size_t unit) {
        const auto next = runs_.upper_bound(unit);
        if (next == runs_.begin()) {
            return;
        }
        const auto run = std::prev(next);
        const std::size_t begin = run->first, end = run->second;
        if (unit >= end) {
            return;
        }
        --size_;
        if (begin == unit) {
            runs_.erase(run);
        } else {
            run->second = unit;
        }
        if (unit + 1 < end) {
            runs_.emplace(unit + 1, end);
        }
    }
    // The first from `from` on for which `wanted` says yes.
    template <typename F>
    std::optional<std::size_t> Find(std::size_t from, const F& wanted) const {
        auto run = runs_.upper_bound(from);
        if (run != runs_.begin() && std::prev(run)->second > from) {
            --run;
        }
        for (; run != runs_.end(); ++run) {
            for (std::size_t unit = std::max(from, run->first); unit < run->second; ++unit) {
                if (wanted(unit)) {
                    return unit;
                }
            }
        }
        return std::nullopt;
    }

  private:
    std::map<std::size_t, std::size_t> runs_;  // begin to end
    std::size_t size_ = 0;
};

}  // namespace relume::jobs
