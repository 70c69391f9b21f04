#include "server/jobs/loss_book.h"

#include <fmt/format.h>

#include <utility>

namespace relume::jobs {
namespace {

std::string Reason(const std::string& words, const std::string& before) {
    return fmt::format(
        "{}; before that, {}. It is not tried again, for it costs workers: their logs may tell "
        "why, and how much memory they had (relume-worker --memory-limit)",
        words, before);
}

}  // namespace

std::string LossBook::Note(const std::string& job, const Loss& loss, std::uint64_t samples_done,
                           TimePoint now) {
    Trials& trials = jobs_[job];
    Trial& trial = loss.unit ? trials.units[*loss.unit] : trials.load;
    // What was under way when another worker was lost is no second trial: one cause, such as a
    // switch that fails, may have ended both.
    if (!loss.crashed && trial.losses > 0 && loss.since <= trial.last) {
        return "";
    }
    const std::string words = fmt::format("worker {} {} while {}", loss.worker, loss.how, loss.at);
    const std::string before = std::exchange(trial.words, words);
    trial.last = now;
    trial.machines.insert(loss.machine);
    trial.crashes += loss.crashed ? 1 : 0;
    if (++trial.losses >= kMaxLosses || trial.crashes >= kMaxCrashes) {
        return Reason(words, before);
    }
    if (loss.crashed && loss.unit) {
        // Any unit may kill whoever renders it.
        const std::string crash_before = std::exchange(trials.crash_words, words);
        if (std::exchange(trials.samples_at_crash, samples_done) == samples_done) {
            return Reason(words, crash_before);
        }
    }
    return "";
}

void LossBook::Loaded(const std::string& job) {
    if (const auto it = jobs_.find(job); it != jobs_.end()) {
        // Where it crashed it is still not tried as long as there are others.
        Trial& load = it->second.load;
        load.machines = load.crashes > 0 ? std::move(load.machines) : std::set<std::string>();
        load.losses = load.crashes = 0;
        ForgetIfClear(job);
    }
}

void LossBook::Done(const std::string& job, std::size_t unit) {
    if (const auto it = jobs_.find(job); it != jobs_.end()) {
        it->second.units.erase(unit);
        ForgetIfClear(job);
    }
}

void LossBook::ForgetIfClear(const std::string& job) {
    const Trials& trials = jobs_.at(job);
    if (trials.units.empty() && trials.load.losses == 0 && trials.load.machines.empty() &&
        !trials.samples_at_crash) {
        jobs_.erase(job);
    }
}

const LossBook::Trial* LossBook::Find(const std::string& job,
                                      std::optional<std::size_t> unit) const {
    const auto it = jobs_.find(job);
    if (it == jobs_.end()) {
        return nullptr;
    }
    if (!unit) {
        return &it->second.load;
    }
    const auto of_unit = it->second.units.find(*unit);
    return of_unit == it->second.units.end() ? nullptr : &of_unit->second;
}

bool LossBook::UnitAlone(const std::string& job, std::size_t unit) const {
    const Trial* trial = Find(job, unit);
    return trial != nullptr && trial->losses >= kLossesTogether;
}

bool LossBook::LoadAlone(const std::string& job) const {
    const Trial* trial = Find(job, std::nullopt);
    return trial != nullptr && trial->losses >= kLossesTogether;
}

const std::set<std::string>* LossBook::Machines(const std::string& job,
                                                std::optional<std::size_t> unit) const {
    const Trial* trial = Find(job, unit);
    return trial == nullptr || trial->machines.empty() ? nullptr : &trial->machines;
}

}  // namespace relume::jobs
