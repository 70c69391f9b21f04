#include <fmt/format.h>

#include <algorithm>
#include <utility>

#include "core/base/check.h"
#include "server/jobs/count_answer.h"
#include "server/jobs/job.h"

// Of Job: the units of its open passes, leased, answered and merged, and whether they add up.
namespace relume::jobs {
namespace {

constexpr double kProgressSeconds = 0.2;   // between events that only report progress
constexpr std::size_t kMergesAtOnce = 16;  // tiles of a backlog, with each result

}  // namespace

bool Job::MergedUnit(std::size_t unit) const {
    if (open_.empty() || unit < open_.front().first_unit) {
        return unit < units_planned_;
    }
    return unit < units_planned_ && PassOf(unit).pass->MergedUnit(Local(unit));
}

bool Job::Awaits(std::size_t unit) const {
    return !open_.empty() && unit >= open_.front().first_unit && unit < units_planned_ &&
           !Done(unit);
}

Job::OpenPass& Job::PassOf(std::size_t unit) {
    return const_cast<OpenPass&>(std::as_const(*this).PassOf(unit));
}

const Job::OpenPass& Job::PassOf(std::size_t unit) const {
    const auto it = std::ranges::find_if(open_, [&](const OpenPass& p) { return unit < p.end(); });
    RELUME_CHECK(it != open_.end() && unit >= it->first_unit);
    return *it;
}

const Job::Unit& Job::At(std::size_t unit) const {
    static const Unit kUntouched;
    const OpenPass& open = PassOf(unit);
    const auto it = open.units.find(unit - open.first_unit);
    return it == open.units.end() ? kUntouched : it->second;
}

std::optional<std::size_t> Job::FindPending(std::size_t from,
                                            const std::function<bool(std::size_t)>& wanted) const {
    return pending_.Find(from, wanted);
}

std::size_t Job::FirstSpareUnit() const {
    if (open_.empty() || stop_) {
        return units_planned_;
    }
    switch (planner_->View()) {
        case FilmView::kNothing:
            return open_.front().end();
        case FilmView::kLagging:
            return open_.back().first_unit + open_.back().pass->first_cover_unit();
        case FilmView::kWhole:
            break;
    }
    return units_planned_;
}

std::uint64_t Job::SamplesAwaited() const {
    const std::size_t end = FirstSpareUnit();
    std::uint64_t samples = 0;
    for (const OpenPass& open : open_) {
        if (open.end() <= end) {
            samples += open.pass->samples_left();
        } else if (open.first_unit < end) {
            samples += open.pass->samples_left_but_cover();
        }
    }
    return samples;
}

void Job::AddLease(std::size_t unit, LeaseId lease, TimePoint now) {
    if (!first_lease_) {
        first_lease_ = now - FromSeconds(info_.render_seconds);
        pass_start_ = now;
        if (!info_.wait_seconds) {
            info_.wait_seconds = ToSeconds(now - info_.created);
        }
    }
    ++info_.leases_issued;
    auto issued = PassOf(unit).issued[Local(unit)];
    info_.leases_reissued += issued ? 1 : 0;
    issued = true;
    At(unit).leases.insert(lease);
}

void Job::Requeue(std::size_t unit) {
    if (!Done(unit)) {
        new_work_ = pending_.Insert(unit) || new_work_;
    }
}

int Job::Refuse(std::size_t unit, WorkerId worker) {
    At(unit).refused.insert(worker);
    return ++At(unit).bad;
}

void Job::Accept(std::size_t unit, const std::string& worker, TileResult result, TimePoint now) {
    OpenPass& open = PassOf(unit);
    const std::uint64_t samples = Samples(unit);
    speed_.Add(now, samples);
    CountAnswer(worker, samples, result, 1, &info_);
    info_.render_seconds = ToSeconds(now - first_lease_.value_or(now));
    pending_.Erase(unit);
    open.units.erase(Local(unit));
    open.pass->Accept(Local(unit), std::move(result), worker);
    MergeTile(open.pass->TileOf(Local(unit)));
    MergeBacklog();
    Proceed(now);
    if (ToSeconds(now - last_publish_) >= kProgressSeconds) {
        Publish(now);
    }
}

void Job::MergeTile(std::size_t tile) {
    for (const OpenPass& open : open_) {
        const auto before = [&](bool cover, const Pass::Waiting& layer) {
            if (copy_) {
                copy_->Merging(*open.pass, tile, cover, layer, *film_);
            }
        };
        // The newest cover is not for the eyes of the next plan.
        open.pass->Merge(tile, stop_ || &open != &open_.back(), film_.get(), before);
        if (!open.pass->Merged(tile)) {
            return;
        }
    }
}

// A few at a time, so that nobody has to wait for long; all if they are what is waited for.
void Job::MergeBacklog() {
    const bool all = SamplesAwaited() == 0;
    for (std::size_t n = 0; !backlog_.empty() && (all || n < kMergesAtOnce); ++n) {
        MergeTile(backlog_.back());
        backlog_.pop_back();
    }
}

LedgerAudit Job::Audit() const {
    LedgerAudit audit;
    for (const PassSummary& pass : info_.passes) {
        audit.ranges += pass.ranges;
    }
    audit.samples = TotalSamples(info_.passes);
    std::uint64_t shares = 0, wrong = 0;
    for (const auto& [name, share] : info_.workers) {
        shares += share.samples;
    }
    for (std::size_t i = 0; i < film_->pixel_count(); ++i) {
        audit.film_samples += film_->NextIndex(i);
        wrong += film_->NextIndex(i) != (*planned_)[i] ? 1 : 0;
    }
    if (wrong > 0) {
        audit.problem = fmt::format("{} pixels hold other samples than were planned", wrong);
    } else if (audit.ranges != units_planned_ || audit.samples != audit.film_samples ||
               audit.samples != info_.samples_done || audit.samples != shares) {
        audit.problem = fmt::format(
            "{} of {} ranges; {} samples planned, {} taken in, {} of workers, {} in the film",
            audit.ranges, units_planned_, audit.samples, info_.samples_done, shares,
            audit.film_samples);
    }
    return audit;
}

}  // namespace relume::jobs
