#include "server/rpc/stream_limit.h"

namespace relume::server {

StreamLimit::Slot StreamLimit::Take(const std::string& address) const {
    {
        const std::lock_guard lock(counts_->mutex);
        std::size_t& open = counts_->open[address];
        if (open >= most_) {
            return nullptr;
        }
        ++open;
    }
    return {counts_.get(), [counts = counts_, address](const void*) {
                const std::lock_guard lock(counts->mutex);
                if (--counts->open.at(address) == 0) {
                    counts->open.erase(address);
                }
            }};
}

}  // namespace relume::server
