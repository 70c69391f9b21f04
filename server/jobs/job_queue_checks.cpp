#include <fmt/format.h>

#include <algorithm>
#include <set>
#include <utility>

#include "core/base/error.h"
#include "core/base/log.h"
#include "server/jobs/job_queue.h"

// Cross-checks of JobQueue: who is asked for a second answer, and what becomes of odd workers.
namespace relume::jobs {
namespace {

constexpr int kMaxRepeats = 1;  // of a worker's answer that another one is against

}  // namespace

bool JobQueue::CouldCheck(const Worker& worker, const Job& job) const {
    const auto it = worker.jobs.find(job.info().name);
    const bool paused =
        it != worker.jobs.end() && last_tick_ && it->second.paused_until > *last_tick_;
    return !worker.silent && worker.credits > 0 && worker.info.quarantined.empty() && !paused &&
           worker.info.numeric_class == job.info().numeric_class;
}

bool JobQueue::MayVote(WorkerId id, const Job& job, std::size_t unit) const {
    const auto* votes = checks_.empty() ? nullptr : checks_.VotesOn({job.info().name, unit});
    if (votes == nullptr) {
        return true;
    }
    const auto has = [&](const Worker& worker, bool machine) {
        return std::ranges::any_of(*votes, [&](const CrossChecks::Vote& vote) {
            return machine ? vote.machine == worker.machine : vote.worker == worker.info.name;
        });
    };
    // The best that there is: another machine, else another worker, else the same ones once more.
    const auto rank = [&](const Worker& worker) {
        return !has(worker, true) ? 2 : !has(worker, false) ? 1 : 0;
    };
    const Worker& own = workers_.at(id);
    const int mine = rank(own);
    const bool best = std::ranges::all_of(workers_, [&](const auto& entry) {
        return !CouldCheck(entry.second, job) || rank(entry.second) <= mine;
    });
    if (!best || mine > 0) {
        return best;
    }
    const auto vote = std::ranges::find(*votes, own.info.name, &CrossChecks::Vote::worker);
    return votes->size() > 1 && vote->repeats < kMaxRepeats;
}

bool JobQueue::HasOtherVoter(const std::string& voter, const Job& job) const {
    return std::ranges::any_of(workers_, [&](const auto& entry) {
        return entry.second.info.name != voter && CouldCheck(entry.second, job);
    });
}

std::optional<CrossChecks::Vote> JobQueue::CrossCheck(WorkerId id, Job* job, std::size_t unit,
                                                      TileResult result, TimePoint now) {
    const Worker& worker = workers_.at(id);
    const std::string& name = job->info().name;
    CrossChecks::Vote vote{id, worker.info.name, worker.machine, std::move(result)};
    if (!checks_.Chosen(job->info().number, unit)) {
        return vote;
    }
    const TileRect r = job->Task(unit).rect;
    CrossChecks::Verdict verdict = checks_.Add({name, unit}, std::move(vote));
    for (const std::string& odd : verdict.odd) {
        Quarantine(
            odd,
            fmt::format("its answer to pixels {},{},{},{} of {} is {}", r.x0, r.y0, r.x1, r.y1,
                        name, verdict.winner ? "not that of two others" : "another each time"),
            now);
    }
    if (verdict.winner) {
        return std::move(verdict.winner);
    }
    const auto* votes = checks_.VotesOn({name, unit});
    if (votes != nullptr && votes->size() == 1 && !HasOtherVoter(votes->front().worker, *job)) {
        return checks_.TakeOnly({name, unit});
    }
    if (votes != nullptr && votes->size() > 1) {
        job->AddNote(
            fmt::format("workers {} and {} give different answers to pixels {},{},{},{}: a "
                        "third one must decide",
                        (*votes)[0].worker, (*votes)[1].worker, r.x0, r.y0, r.x1, r.y1),
            now);
    }
    RequeueIfLate(job, unit);
    return std::nullopt;
}

// Answers whose second one nobody is left to give.
void JobQueue::ConcludeChecks(TimePoint now) {
    for (const CrossChecks::Unit& unit : checks_.Waiting()) {
        Job& job = Find(unit.first);
        const auto* votes = checks_.VotesOn(unit);
        if (votes != nullptr && votes->size() == 1 && job.active() &&
            !HasOtherVoter(votes->front().worker, job)) {
            Accept(&job, unit.second, checks_.TakeOnly(unit), now);
        }
    }
}

void JobQueue::Quarantine(const std::string& name, const std::string& why, TimePoint now) {
    const auto it = std::ranges::find_if(
        workers_, [&](const auto& entry) { return entry.second.info.name == name; });
    {
        const LogScope scope({.worker = name});
        spdlog::error(
            "worker {}: in quarantine, it gets no more leases until it is released or started "
            "anew: {}",
            name, why);
    }
    if (it != workers_.end()) {
        Worker& worker = it->second;
        worker.info.quarantined = why;
        worker.info.quarantined_since = now;
        quarantined_[{worker.machine, worker.asked}] = {name, why, now};
        while (!worker.leases.empty()) {
            const auto lease = leases_.find(*worker.leases.begin());
            worker.revoked.push_back(lease->first);
            GiveBack(lease);
        }
        news_ = true;
    }
    for (const CrossChecks::Unit& unit : checks_.DropVotesOf(name)) {
        Job& job = Find(unit.first);
        if (job.Awaits(unit.second)) {
            RequeueIfLate(&job, unit.second);
        }
    }
    for (const auto& [number, job] : not_over_) {
        const auto share = job->info().workers.find(name);
        if (share == job->info().workers.end() || share->second.samples == 0) {
            continue;
        }
        job->AddNote(
            fmt::format(
                "worker {} is in quarantine: {}. {:.3g} % of the samples so far are its, and "
                "stay in the image: render again if that matters",
                name, why,
                100.0 * static_cast<double>(share->second.samples) /
                    static_cast<double>(std::max<std::uint64_t>(1, job->info().samples_done))),
            now);
    }
}

void JobQueue::Release(const std::string& name) {
    // By the name that it has now, or had then: it may have come back under another one.
    std::set<std::pair<std::string, std::string>> found;
    for (const auto& [key, quarantined] : quarantined_) {
        if (quarantined.name == name) {
            found.insert(key);
        }
    }
    for (const auto& [id, worker] : workers_) {
        if (worker.info.name == name && !worker.info.quarantined.empty()) {
            found.emplace(worker.machine, worker.asked);
        }
    }
    if (found.empty()) {
        ThrowNotFound(fmt::format(
            "no worker '{:.128}' is in quarantine; `relume workers` lists those that are", name));
    }
    for (const auto& key : found) {
        quarantined_.erase(key);
    }
    for (auto& [id, worker] : workers_) {
        if (found.count({worker.machine, worker.asked}) != 0) {
            worker.info.quarantined.clear();
            worker.info.quarantined_since = {};
        }
    }
    const LogScope scope({.worker = name});
    spdlog::info("worker {}: released from quarantine", name);
    news_ = true;
}

}  // namespace relume::jobs
