#include "server/jobs/fair_share.h"

#include <algorithm>
#include <cmath>

namespace relume::jobs {
namespace {

constexpr double kFadeSeconds = 60;

}  // namespace

double FairShare::Recent::Get(TimePoint now) const {
    return value_ * std::exp(-std::max(0.0, ToSeconds(now - at_)) / kFadeSeconds);
}

FairShare::Owner* FairShare::Find(const Key& key) {
    const auto level = levels_.find(key.priority);
    if (level == levels_.end()) {
        return nullptr;
    }
    const auto owner = level->second.owners.find(key.owner);
    return owner == level->second.owners.end() ? nullptr : &owner->second;
}

const FairShare::Place* FairShare::StayWith(int priority, const Level& level,
                                            const Key* last) const {
    if (last == nullptr || last->priority != priority || level.order.empty()) {
        return nullptr;
    }
    const auto owner = level.owners.find(last->owner);
    if (owner == level.owners.end() || !owner->second.placed ||
        owner->second.jobs.started.empty()) {
        return nullptr;
    }
    const double lowest = level.order.begin()->first.first;
    if (owner->second.used + owner->second.out >= lowest + slack_) {
        return nullptr;
    }
    return &*level.order.find(PlaceOf(const_cast<Owner*>(&owner->second)));
}

template <typename Change>
void FairShare::ChangeAccount(const Key& key, Change&& change) {
    Owner* owner = Find(key);
    if (owner == nullptr) {
        return;  // closed since
    }
    std::set<Place>& order = levels_.at(key.priority).order;
    if (owner->placed) {
        order.erase(PlaceOf(owner));
    }
    change(owner);
    if (owner->placed) {
        order.insert(PlaceOf(owner));
    }
}

void FairShare::Put(std::uint64_t job, const Key& key, bool started) {
    const auto [entry, fresh] = entries_.try_emplace(job);
    if (!fresh && entry->second.key == key && entry->second.started == started) {
        return;
    }
    if (!fresh && entry->second.key != key) {
        Leave(job, entry->second.key);
    }
    entry->second.key = key;
    entry->second.started = started;
    Level& level = levels_[key.priority];
    const auto [it, is_new] = level.owners.try_emplace(key.owner);
    Owner& owner = it->second;
    if (is_new) {
        owner.serial = ++last_serial_;
    }
    if (!owner.placed) {
        if (!level.order.empty()) {
            const double least = level.order.begin()->first.first - slack_;
            owner.used = is_new ? least : std::max(owner.used, least - owner.out);
        }
        owner.placed = true;
        level.order.insert(PlaceOf(&owner));
    }
    (started ? owner.jobs.waiting : owner.jobs.started).erase(job);
    (started ? owner.jobs.started : owner.jobs.waiting).insert(job);
}

void FairShare::Remove(std::uint64_t job) {
    const auto entry = entries_.extract(job);
    if (!entry.empty()) {
        Leave(job, entry.mapped().key);
    }
}

void FairShare::Leave(std::uint64_t job, const Key& key) {
    Owner* owner = Find(key);
    owner->jobs.started.erase(job);
    owner->jobs.waiting.erase(job);
    if (owner->jobs.started.empty() && owner->jobs.waiting.empty()) {
        levels_.at(key.priority).order.erase(PlaceOf(owner));
        owner->placed = false;
        CloseIfIdle(key.priority);
    }
}

// When nobody has jobs of the priority, and no lease is out.
void FairShare::CloseIfIdle(int priority) {
    const auto level = levels_.find(priority);
    if (level != levels_.end() && level->second.order.empty() &&
        std::ranges::all_of(level->second.owners,
                            [](const auto& entry) { return entry.second.leases == 0; })) {
        levels_.erase(level);
    }
}

void FairShare::Lend(const Charge& charge) {
    ChangeAccount(charge.key, [&](Owner* owner) {
        owner->out += charge.seconds;
        ++owner->leases;
    });
}

void FairShare::Return(const Charge& charge) {
    ChangeAccount(charge.key, [&](Owner* owner) {
        --owner->leases;
        owner->out = owner->leases == 0 ? 0 : std::max(0.0, owner->out - charge.seconds);
    });
    CloseIfIdle(charge.key.priority);
}

void FairShare::Use(std::uint64_t job, const Key& key, double seconds, TimePoint now) {
    ChangeAccount(key, [&](Owner* owner) { owner->used += seconds; });
    if (const auto entry = entries_.find(job); entry != entries_.end()) {
        entry->second.recent.Add(seconds, now);
    }
    all_.Add(seconds, now);
}

double FairShare::Share(std::uint64_t job, TimePoint now) const {
    const auto entry = entries_.find(job);
    const double all = all_.Get(now);
    return entry == entries_.end() || all <= 0
               ? 0
               : std::clamp(entry->second.recent.Get(now) / all, 0.0, 1.0);
}

double FairShare::Account(const Key& key) const {
    const Owner* owner = const_cast<FairShare*>(this)->Find(key);
    return owner == nullptr ? 0 : owner->used + owner->out;
}

}  // namespace relume::jobs
