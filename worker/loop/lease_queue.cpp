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
            running_.push_back({lease.id, lease.stream, lease.cancel});
            return lease;
        }
        changed_.wait(lock);
    }
}

void LeaseQueue::Finish(const HeldLease& lease) {
    const std::lock_guard lock(mutex_);
    std::erase_if(running_, [&](const Running& running) { return running.cancel == lease.cancel; });
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

std::vector<std::uint64_t> LeaseQueue::Drop(const std::vector<std::uint64_t>& ids,
                                            const WorkStream* stream) {
    const std::lock_guard lock(mutex_);
    const auto meant = [&](const auto& lease) {
        return lease.stream.get() == stream &&
               std::find(ids.begin(), ids.end(), lease.id) != ids.end();
    };
    for (const Running& running : running_) {
        if (meant(running)) {
            running.cancel->Cancel();
        }
    }
    return RemoveWaiting(meant);
}

std::vector<std::uint64_t> LeaseQueue::DropAll() {
    const std::lock_guard lock(mutex_);
    return RemoveWaiting([](const HeldLease&) { return true; });
}

void LeaseQueue::CancelRunning() {
    const std::lock_guard lock(mutex_);
    for (const Running& running : running_) {
        running.cancel->Cancel();
    }
}

void LeaseQueue::CancelOthers(const WorkStream* stream) {
    const std::lock_guard lock(mutex_);
    for (const Running& running : running_) {
        if (running.stream.get() != stream) {
            running.cancel->Cancel();
        }
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
