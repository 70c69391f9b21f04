#pragma once

#include <cstdint>
#include <map>
#include <set>
#include <string>
#include <utility>

#include "core/base/clock.h"

namespace relume::jobs {

inline constexpr int kMinPriority = -100, kMaxPriority = 100;  // higher ones first

// The order in which jobs get leases. Strictly by priority; owners of jobs of one priority share
// what they get evenly, in core-seconds; of one owner's jobs of one priority the oldest is first.
//
// Each owner has an account in each priority: the core-seconds of its answers, and those predicted
// for its leases that are out. The lowest is served first. An owner who comes to have jobs, newly
// or again, begins one `slack` below the lowest of those who have some, unless its account is
// higher: it is served at once, and has no claim to what it did not ask for meanwhile. Accounts are
// closed when nobody has jobs of the priority. (Start-time fair queueing: Goyal, Vin and Cheng
// 1996.) So an owner who has work never falls behind others of its priority by more than two slacks
// and the leases that are out. Across priorities there is no such promise.
//
// Pure state, of the thread of its JobQueue.
class FairShare {
  public:
    struct Key {
        int priority = 0;
        std::string owner;
        bool operator==(const Key&) const = default;
    };
    // What a lease counts for until its answer is there.
    struct Charge {
        Key key;
        double seconds = 0;  // of one core
    };
    // Jobs of one owner and priority, by number.
    struct Jobs {
        std::set<std::uint64_t> started, waiting;
    };

    // A worker stays with the owner that it worked for last, while that is not ahead of the lowest
    // account by more than `seconds`: it need not load scenes for each lease.
    void SetSlack(double seconds) { slack_ = seconds; }
    double slack() const { return slack_; }

    // The job takes part, or goes on to do so as said now.
    void Put(std::uint64_t job, const Key& key, bool started);
    void Remove(std::uint64_t job);

    void Lend(const Charge& charge);
    // The lease is not out any more, whatever came of it.
    void Return(const Charge& charge);
    // The job was given so many core-seconds.
    void Use(std::uint64_t job, const Key& key, double seconds, TimePoint now);

    // The job's part of all core-seconds of the last minute, 0 to 1; those before fade.
    double Share(std::uint64_t job, TimePoint now) const;
    // Core-seconds in the account; 0 if there is none.
    double Account(const Key& key) const;

    // Calls visit(Jobs) for each owner and priority that has jobs, in order of service, until it
    // answers true; answers with that. `last`: whom the worker worked for last, or null. Jobs may
    // be put and removed by a visit that then answers true, and put from waiting to started by any.
    template <typename Visit>
    bool Each(const Key* last, Visit&& visit) {
        for (const auto& [priority, level] : levels_) {
            const Place* stay = StayWith(priority, level, last);
            if (stay != nullptr && visit(stay->second->jobs)) {
                return true;
            }
            for (auto it = level.order.begin(); it != level.order.end();) {
                const Place& place = *it++;
                if (&place != stay && visit(place.second->jobs)) {
                    return true;
                }
            }
        }
        return false;
    }

  private:
    struct Owner {
        Jobs jobs;
        double used = 0, out = 0;  // core-seconds
        std::uint64_t leases = 0;  // that are out
        std::uint64_t serial = 0;  // in order of first coming, for accounts that are equal
        bool placed = false;       // in the order: it has jobs
    };
    using Place = std::pair<std::pair<double, std::uint64_t>, Owner*>;
    struct Level {
        std::map<std::string, Owner> owners;
        std::set<Place> order;
    };
    // A sum that fades with time.
    class Recent {
      public:
        void Add(double value, TimePoint now) {
            value_ = Get(now) + value;
            at_ = now;
        }
        double Get(TimePoint now) const;

      private:
        double value_ = 0;
        TimePoint at_{};
    };
    struct Entry {
        Key key;
        bool started = false;
        Recent recent;
    };

    static Place PlaceOf(Owner* owner) {
        return {{owner->used + owner->out, owner->serial}, owner};
    }
    const Place* StayWith(int priority, const Level& level, const Key* last) const;
    Owner* Find(const Key& key);
    // Changes the owner's account, and so its place.
    template <typename Change>
    void ChangeAccount(const Key& key, Change&& change);
    void Leave(std::uint64_t job, const Key& key);
    void CloseIfIdle(int priority);

    std::map<int, Level, std::greater<>> levels_;
    std::map<std::uint64_t, Entry> entries_;  // by job
    Recent all_;
    double slack_ = 0;
    std::uint64_t last_serial_ = 0;
};

}  // namespace relume::jobs
