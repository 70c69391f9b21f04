#include "server/jobs/cross_checks.h"

#include <algorithm>
#include <cstring>

namespace relume::jobs {
namespace {

// Steele, Lea and Flood, "Fast splittable pseudorandom number generators", 2014: mix64.
std::uint64_t Mix(std::uint64_t z) {
    z = (z ^ (z >> 30)) * 0xbf58476d1ce4e5b9ULL;
    z = (z ^ (z >> 27)) * 0x94d049bb133111ebULL;
    return z ^ (z >> 31);
}

template <typename T>
bool SameBits(const std::vector<T>& a, const std::vector<T>& b) {
    return a.size() == b.size() &&
           (a.empty() || std::memcmp(a.data(), b.data(), a.size() * sizeof(T)) == 0);
}

bool Same(const TileResult& a, const TileResult& b) {
    return SameBits(a.planes, b.planes) && SameBits(a.samples, b.samples);
}

}  // namespace

bool CrossChecks::Chosen(std::uint64_t job_number, std::size_t unit) const {
    return share_ > 0 &&
           static_cast<double>(Mix(Mix(Mix(salt_) + job_number) + unit) >> 11) * 0x1p-53 < share_;
}

const std::vector<CrossChecks::Vote>* CrossChecks::VotesOn(const Unit& unit) const {
    const auto it = votes_.find(unit);
    return it == votes_.end() ? nullptr : &it->second;
}

CrossChecks::Verdict CrossChecks::Add(const Unit& unit, Vote vote) {
    Verdict verdict;
    std::vector<Vote>& votes = votes_[unit];
    const auto own = std::ranges::find(votes, vote.worker, &Vote::worker);
    if (own != votes.end()) {
        if (Same(own->result, vote.result)) {
            ++own->repeats;
        } else {
            verdict.odd.push_back(vote.worker);
            votes.erase(own);
        }
    } else {
        const auto twin = std::ranges::find_if(
            votes, [&](const Vote& other) { return Same(other.result, vote.result); });
        if (twin == votes.end()) {
            votes.push_back(std::move(vote));
        } else {
            ++counts.equal;
            verdict.winner = std::move(*twin);
            votes.erase(twin);
            for (const Vote& other : votes) {
                verdict.odd.push_back(other.worker);
            }
            votes.clear();
        }
    }
    counts.odd += verdict.odd.size();
    if (votes.empty()) {
        votes_.erase(unit);
    }
    return verdict;
}

CrossChecks::Vote CrossChecks::TakeOnly(const Unit& unit) {
    ++counts.alone;
    Vote vote = std::move(votes_.at(unit).front());
    votes_.erase(unit);
    return vote;
}

std::vector<CrossChecks::Unit> CrossChecks::DropVotesOf(const std::string& worker) {
    std::vector<Unit> units;
    for (auto it = votes_.begin(); it != votes_.end();) {
        if (std::erase_if(it->second, [&](const Vote& v) { return v.worker == worker; }) > 0) {
            units.push_back(it->first);
        }
        it = it->second.empty() ? votes_.erase(it) : std::next(it);
    }
    return units;
}

void CrossChecks::Forget(const std::string& job) {
    std::erase_if(votes_, [&](const auto& entry) { return entry.first.first == job; });
}

bool CrossChecks::HasVotes(const std::string& job) const {
    const auto it = votes_.lower_bound({job, 0});
    return it != votes_.end() && it->first.first == job;
}

std::vector<CrossChecks::Unit> CrossChecks::Waiting() const {
    std::vector<Unit> units;
    for (const auto& [unit, votes] : votes_) {
        units.push_back(unit);
    }
    return units;
}

}  // namespace relume::jobs
