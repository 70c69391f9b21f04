#include "worker/loop/kept_results.h"

namespace relume::worker {

void KeptResults::Keep(const v1::WorkRequest& message) {
    const std::string& ticket = message.result().ticket();
    Drop(ticket);
    bytes_ += message.result().planes().size();
    results_.emplace(++last_, message);
    by_ticket_.emplace(ticket, last_);
    while (bytes_ > max_bytes_) {
        Drop(std::string(results_.begin()->second.result().ticket()));
    }
}

void KeptResults::Drop(const std::string& ticket) {
    if (const auto it = by_ticket_.find(ticket); it != by_ticket_.end()) {
        const auto result = results_.find(it->second);
        bytes_ -= result->second.result().planes().size();
        results_.erase(result);
        by_ticket_.erase(it);
    }
}

std::vector<v1::WorkRequest> KeptResults::All() const {
    std::vector<v1::WorkRequest> all;
    for (const auto& [age, message] : results_) {
        all.push_back(message);
    }
    return all;
}

}  // namespace relume::worker
