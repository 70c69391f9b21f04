#pragma once

#include <cstddef>
#include <cstdint>
#include <map>
#include <optional>
#include <set>
#include <string>

#include "core/base/clock.h"

namespace relume::jobs {

// From this many losses over one thing on, it is lent to a worker that has nothing else in hand.
inline constexpr int kLossesTogether = 2;
inline constexpr int kMaxLosses = 6;   // over one thing, then its job fails
inline constexpr int kMaxCrashes = 2;  // likewise, of workers that could say what they died of

// Workers that were lost while they were at work, held against what they were at: loading a job's
// scene, or a unit of it. A job that costs one worker after the other fails, so that the farm does
// not; one whose workers are lost by chance does not. The rule is in
// docs/adr/2026-11-26-losses-held-against-a-job.md. Pure state.
class LossBook {
  public:
    struct Loss {
        std::string worker, machine;
        std::optional<std::size_t> unit;  // of the job; nothing: it was loading the scene
        std::string at;                   // what it was doing, for people: "it rendered ..."
        std::string how;                  // what is known of its end
        bool crashed = false;             // it said itself that it died there
        TimePoint since{};                // when it was given this to do
    };
    // Why the job is to fail; "": it may be tried again. `samples_done`: of the job by now.
    std::string Note(const std::string& job, const Loss& loss, std::uint64_t samples_done,
                     TimePoint now);

    // A worker has loaded the job's scene; a unit of it is done; the job is over.
    void Loaded(const std::string& job);
    void Done(const std::string& job, std::size_t unit);
    void Forget(const std::string& job) { jobs_.erase(job); }

    // To be lent to a worker that has nothing else in hand: the unit, or whatever comes first to
    // those that have not loaded the scene.
    bool UnitAlone(const std::string& job, std::size_t unit) const;
    bool LoadAlone(const std::string& job) const;
    // Nothing was ever lost over what is still to be done.
    bool empty() const { return jobs_.empty(); }
    // The machines that workers were lost on over this; null: none.
    const std::set<std::string>* Machines(const std::string& job,
                                          std::optional<std::size_t> unit) const;

  private:
    struct Trial {
        int losses = 0, crashes = 0;
        TimePoint last{};  // loss
        std::set<std::string> machines;
        std::string words;  // of the last loss
    };
    struct Trials {
        Trial load;
        std::map<std::size_t, Trial> units;
        // Of the last crash over any unit.
        std::optional<std::uint64_t> samples_at_crash;
        std::string crash_words;
    };
    void ForgetIfClear(const std::string& job);
    const Trial* Find(const std::string& job, std::optional<std::size_t> unit) const;

    std::map<std::string, Trials> jobs_;
};

}  // namespace relume::jobs
