#pragma once

#include <cstddef>
#include <map>
#include <memory>
#include <mutex>
#include <string>

namespace relume::server {

// How many streams each address has open. Thread-safe.
class StreamLimit {
  public:
    explicit StreamLimit(std::size_t most) : counts_(std::make_shared<Counts>()), most_(most) {}

    // Counts as one stream of the address as long as it, or a copy, lives; it may outlive the
    // limit. Null: there are too many.
    using Slot = std::shared_ptr<const void>;
    Slot Take(const std::string& address) const;

    std::size_t most() const { return most_; }

  private:
    struct Counts {
        std::mutex mutex;
        std::map<std::string, std::size_t> open;  // by address, none with 0
    };
    std::shared_ptr<Counts> counts_;
    std::size_t most_;
};

}  // namespace relume::server
