#pragma once

#include <cstddef>
#include <cstdint>
#include <map>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "core/film/tile.h"
#include "server/jobs/job_info.h"

namespace relume::jobs {

// Answers that are kept until another worker has given the same one: samples are pure functions of
// what is asked for, so that honest answers of a numeric class are equal to the bit. The rule is in
// docs/adr/2026-11-26-cross-checks-before-merging.md. Pure state.
class CrossChecks {
  public:
    // A share of the units, 0 to 1, chosen by a `salt` that no worker knows.
    void Configure(double share, std::uint64_t salt) {
        share_ = share;
        salt_ = salt;
    }
    bool Chosen(std::uint64_t job_number, std::size_t unit) const;

    struct Vote {
        std::uint64_t id = 0;  // of the worker, which may be gone by now
        std::string worker, machine;
        TileResult result;
        int repeats = 0;  // of the same answer by the same worker
    };
    using Unit = std::pair<std::string, std::size_t>;  // of a job
    // The answers to a unit so far; null: none.
    const std::vector<Vote>* VotesOn(const Unit& unit) const;
    struct Verdict {
        std::optional<Vote> winner;  // two gave this answer: the first of them
        std::vector<std::string>
            odd;  // workers whose answer it is not, or who contradict themselves
    };
    Verdict Add(const Unit& unit, Vote vote);
    // The only answer that there is, without a second one.
    Vote TakeOnly(const Unit& unit);
    // Units that lost a vote by it.
    std::vector<Unit> DropVotesOf(const std::string& worker);
    void Forget(const std::string& job);
    // No answer, or none of the job, waits for another one.
    bool empty() const { return votes_.empty(); }
    bool HasVotes(const std::string& job) const;
    // All units that have votes.
    std::vector<Unit> Waiting() const;

    CheckCounts counts;

  private:
    double share_ = 0;
    std::uint64_t salt_ = 0;
    std::map<Unit, std::vector<Vote>> votes_;
};

}  // namespace relume::jobs
