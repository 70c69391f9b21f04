#include "worker/loop/lease_queue.h"

#include <algorithm>
#include <utility>

namespace relume::worker {

void LeaseQueue::Push(HeldLease lease) {
    const std::lock_guard lock(mutex_);
    waiting_.push_back(std::move(lease));
    changed_.notify_all();
}

std::optional<HeldLease> LeaseQueue::Take() {
    std::unique_lock lock(mutex_);
    for (;;) {
        if (closed_) {
            return std::nullopt;
        }
        const auto it = std::find_if(waiting_.begin(), waiting_.end(),
                                     [](const HeldLease& lease) { return lease.scene != nullptr; });
        if (it != waiting_.end()) {
            HeldLease lease = std::move(*it);
            waiting_.erase(it);
            running_[lease.id] = lease.cancel;
            return lease;
        }
        changed_.wait(lock);
    }
}

void LeaseQueue::Finish(const HeldLease& lease) {
    const std::lock_guard lock(mutex_);
    const auto it = running_.find(lease.id);
    if (it != running_.end() && it->second == lease.cancel) {
        running_.erase(it);
    }
    changed_.notify_all();
}

void LeaseQueue::SetScene(const std::string& job, std::shared_ptr<const LoadedScene> scene) {
    const std::lock_guard lock(mutex_);
    for (auto& lease : waiting_) {
        if (lease.job == job) {
            lease.scene = scene;
        }
    }
    changed_.notify_all();
}

template <typename Predicate>
std::vector<std::uint64_t> LeaseQueue::RemoveWaiting(Predicate predicate) {
    std::vector<std::uint64_t> ids;
    std::erase_if(waiting_, [&](const HeldLease& lease) {
        if (!predicate(lease)) {
            return false;
        }
        ids.push_back(lease.id);
        return true;
    });
    return ids;
}

std::vector<std::uint64_t> LeaseQueue::DropJob(const std::string& job) {
    const std::lock_guard lock(mutex_);
    return RemoveWaiting([&](const HeldLease& lease) { return lease.job == job; });
}

std::vector<std::uint64_t> LeaseQueue::Drop(const std::vector<std::uint64_t>& ids) {
    const std::lock_guard lock(mutex_);
    for (const auto id : ids) {
        if (const auto it = running_.find(id); it != running_.end()) {
            it->second->Cancel();
        }
    }
    return RemoveWaiting([&](const HeldLease& lease) {
        return std::find(ids.begin(), ids.end(), lease.id) != ids.end();
    });
}

std::vector<std::uint64_t> LeaseQueue::DropAll() {
    const std::lock_guard lock(mutex_);
    return RemoveWaiting([](const HeldLease&) { return true; });
}

void LeaseQueue::CancelRunning() {
    const std::lock_guard lock(mutex_);
    for (const auto& [id, cancel] : running_) {
        cancel->Cancel();
    }
}

bool LeaseQueue::WaitIdle(std::chrono::milliseconds limit) {
    std::unique_lock lock(mutex_);
    return changed_.wait_for(lock, limit, [&] { return running_.empty(); });
}

void LeaseQueue::Close() {
    const std::lock_guard lock(mutex_);
    closed_ = true;
    changed_.notify_all();
}

std::size_t LeaseQueue::held() const {
    const std::lock_guard lock(mutex_);
    return waiting_.size() + running_.size();
}

}  // namespace relume::worker
