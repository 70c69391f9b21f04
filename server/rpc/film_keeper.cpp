#include "server/rpc/film_keeper.h"

#include <fmt/format.h>
#include <time.h>

#include <algorithm>
#include <numeric>

#include "core/base/byte_stream.h"
#include "core/base/error.h"
#include "core/base/log.h"
#include "server/rpc/saved_film.h"
#include "server/rpc/saved_info.h"

namespace relume::server {
namespace {

constexpr double kShare = 50;        // seconds between saves for each second that one takes
constexpr double kRetrySeconds = 2;  // after a save that failed
constexpr std::size_t kTilesAtOnce = 2;
constexpr int kSnapshotsKept = 2;

double ThreadSeconds() {
    timespec t{};
    clock_gettime(CLOCK_THREAD_CPUTIME_ID, &t);
    return static_cast<double>(t.tv_sec) + 1e-9 * static_cast<double>(t.tv_nsec);
}

// Passes in order, those wholly in the film first.
std::vector<store::PassRow> PassRows(const jobs::Checkpoint& checkpoint) {
    std::vector<store::PassRow> rows;
    for (const jobs::PassSummary& pass : checkpoint.info.passes) {
        rows.push_back({pass.index, pass.samples, pass.ranges, pass.samples, pass.ranges});
    }
    for (const jobs::OpenPassState& open : checkpoint.open) {
        // Each layer of a tile is one range.
        rows.push_back({static_cast<std::uint32_t>(rows.size()), open.samples, open.ranges,
                        open.merged_samples,
                        std::accumulate(open.merged.begin(), open.merged.end(), std::uint64_t{0})});
    }
    return rows;
}

}  // namespace

FilmKeeper::FilmKeeper(const Options& options, Hooks hooks, jobs::JobQueue* queue,
                       store::Ledger* ledger, store::SnapshotStore* store, const WallClock* wall,
                       SerialExecutor* control, SerialExecutor* files)
    : options_(options),
      hooks_(std::move(hooks)),
      queue_(queue),
      ledger_(ledger),
      store_(store),
      wall_(wall),
      control_(control),
      files_(files) {}

std::string FilmKeeper::FilePrefix(const std::string& job) {
    std::string prefix = job;
    std::replace(prefix.begin(), prefix.end(), '/', '-');
    return prefix + "-";
}

std::optional<jobs::SavedJob> FilmKeeper::Load(const std::string& job, double used_seconds,
                                               TimePoint now) const {
    const LogScope scope({.job = job});
    for (const store::SnapshotRow& row : ledger_->Snapshots(job)) {
        try {
            return ReadSavedFilm(*store_, row.file, used_seconds, *wall_, now);
        } catch (const Error& error) {
            spdlog::warn("{}: passes over a saved film: {}", job, error.what());
        }
    }
    return std::nullopt;
}

void FilmKeeper::Tick(TimePoint now) {
    if (stopped_ || options_.save_seconds == 0) {
        return;
    }
    if (copying_) {
        if (copying_->stalled.exchange(false)) {
            CopyMore(copying_);
        }
        return;
    }
    if (all_saved_) {
        SaveNext();
        return;  // what is not due waits for the next server
    }
    const std::string* oldest = nullptr;
    Kept* due = nullptr;
    for (const std::string& name : queue_->Rendering()) {
        const auto [it, fresh] = jobs_.try_emplace(name);
        if (fresh || it->second.due == TimePoint{}) {
            it->second.due = now + FromSeconds(options_.save_seconds);
        }
        if (Changed(name, it->second) && it->second.due <= now &&
            (due == nullptr || it->second.due < due->due)) {
            due = &it->second;
            oldest = &it->first;
        }
    }
    if (due != nullptr) {
        Begin(*oldest, due, now);
    }
}

bool FilmKeeper::Changed(const std::string& job, const Kept& kept) const {
    return kept.held || queue_->Get(job).samples_done != kept.samples;
}

void FilmKeeper::SaveAll(std::function<void()> done) {
    if (stopped_ || options_.save_seconds == 0) {
        done();
        return;
    }
    all_saved_ = std::move(done);
    to_save_ = queue_->Rendering();
    SaveNext();
}

void FilmKeeper::SaveNext() {
    if (!all_saved_ || stopped_) {
        return;
    }
    while (!copying_ && !to_save_.empty()) {
        const std::string& name = to_save_.back();
        Kept& kept = jobs_[name];
        const bool renders =
            queue_->Knows(name) && queue_->Get(name).state == jobs::JobState::kRendering;
        if (renders && Changed(name, kept) && !Begin(name, &kept, clock_.Now())) {
            return;  // again at the next tick
        }
        to_save_.pop_back();
    }
    if (!copying_) {
        // After all that was given to the files thread before.
        files_->Post([this, done = std::exchange(all_saved_, nullptr)] { control_->Post(done); });
    }
}

bool FilmKeeper::Begin(const std::string& job, Kept* kept, TimePoint now) {
    const double start = ThreadSeconds();
    const auto save = std::make_shared<Save>();
    const jobs::Checkpoint* begun = queue_->BeginCopy(
        job, [this, weak = std::weak_ptr(save)](std::size_t tile, std::string bytes) {
            if (const auto to = weak.lock()) {
                ++to->tiles;
                to->waiting_bytes += bytes.size();
                Post(to,
                     [this, tile, bytes = std::move(bytes)](Save* s) { AddTile(s, tile, bytes); });
            }
        });
    if (begun == nullptr) {
        return false;  // a plan is being made: at the next tick
    }
    save->job = job;
    save->tiles_due = CutIntoTiles(begun->window, begun->tile_size).size();
    save->header = FilmHeader(*begun);
    // What is in the film now will be safe.
    const auto safe = std::stable_partition(
        kept->answers.begin(), kept->answers.end(),
        [&](const Answer& answer) { return !queue_->MergedUnit(job, answer.unit); });
    save->answers.assign(std::make_move_iterator(safe),
                         std::make_move_iterator(kept->answers.end()));
    kept->answers.erase(safe, kept->answers.end());
    kept->samples = queue_->Get(job).samples_done;
    kept->due = now + FromSeconds(options_.save_seconds);
    Post(save, [this](Save* s) { Open(s); });
    copying_ = save;
    save->control_seconds += ThreadSeconds() - start;
    CopyMore(save);
    return true;
}

// Some tiles at a time, between the control thread's other tasks.
void FilmKeeper::CopyMore(std::shared_ptr<Save> save) {
    if (save != copying_ || stopped_) {
        return;
    }
    if (save->waiting_bytes > options_.max_waiting_bytes) {
        save->stalled = true;
        return;
    }
    const double start = ThreadSeconds();
    bool more = false;
    if (queue_->Knows(save->job)) {
        more = queue_->CopyTiles(save->job, kTilesAtOnce);
    }
    save->control_seconds += ThreadSeconds() - start;
    if (more) {
        control_->Post([this, save] { CopyMore(save); });
        return;
    }
    if (save->tiles < save->tiles_due) {
        Abandon(save->job);  // all samples came in meanwhile, or the job is over
        return;
    }
    save->checkpoint = *queue_->TakeCopied(save->job);
    copying_.reset();
    Post(save, [this](Save* s) { Commit(s); });
    files_->Post([this, save] { control_->Post([this, save] { Ended(save); }); });
}

// Gives up the copy of the job, if that is being copied.
void FilmKeeper::Abandon(const std::string& job) {
    if (!copying_ || copying_->job != job) {
        return;
    }
    const std::shared_ptr<Save> save = std::move(copying_);
    std::vector<Answer>& answers = jobs_[job].answers;
    answers.insert(answers.end(), save->answers.begin(), save->answers.end());
    if (!stopped_) {
        files_->Post([save] { save->writer.reset(); });
    }
}

void FilmKeeper::Final(const jobs::JobQueue::FilterWork& work) {
    if (stopped_ || options_.save_seconds == 0) {
        return;
    }
    const auto save = std::make_shared<Save>();
    save->job = work.name;
    save->final = true;
    save->header = FilmHeader(*work.checkpoint);
    Abandon(work.name);
    if (const auto it = jobs_.find(work.name); it != jobs_.end()) {
        save->answers = std::move(it->second.answers);
        jobs_.erase(it);
    }
    Post(save, [this, film = work.film, checkpoint = work.checkpoint](Save* s) {
        s->checkpoint = *checkpoint;
        Open(s);
        const auto tiles = CutIntoTiles(checkpoint->window, checkpoint->tile_size);
        for (std::size_t i = 0; i < tiles.size(); ++i) {
            AddTile(s, i, film->SaveTile(tiles[i]));
        }
        Commit(s);
    });
    files_->Post([this, save] { control_->Post([this, save] { Ended(save); }); });
}

// Does a part of a save on the files thread, unless an earlier one failed.
void FilmKeeper::Post(const std::shared_ptr<Save>& save, std::function<void(Save*)> work) {
    if (stopped_) {
        return;
    }
    files_->Post([save, work = std::move(work)] {
        if (save->error) {
            return;
        }
        const double start = ThreadSeconds();
        try {
            work(save.get());
        } catch (const Error& error) {
            save->error = error;
            save->writer.reset();
        } catch (const std::exception& error) {
            save->error = Error(ErrorCode::kInternal, error.what());
            save->writer.reset();
        }
        save->seconds += ThreadSeconds() - start;
    });
}

void FilmKeeper::Open(Save* save) {
    // Higher than all before, whatever of them is still there.
    const std::uint64_t sequence = (std::uint64_t{ledger_->epoch()} << 32) + ++sequence_;
    save->sequence = sequence;
    save->writer = store_->Begin(fmt::format("{}{}", FilePrefix(save->job), sequence));
    save->writer->Add(save->header);
}

void FilmKeeper::AddTile(Save* save, std::size_t tile, const std::string& bytes) {
    ByteWriter head;
    head.Put<std::uint64_t>(tile);
    head.Put<std::uint64_t>(bytes.size());
    save->writer->Add(head.Take(), bytes);
    save->waiting_bytes -= std::min<std::size_t>(save->waiting_bytes, bytes.size());
    // Should copying stall just now, Tick sees it.
    if (save->waiting_bytes <= options_.max_waiting_bytes / 2 && save->stalled.exchange(false)) {
        control_->Post([this, copied = save->shared_from_this()] { CopyMore(copied); });
    }
}

void FilmKeeper::Commit(Save* save) {
    save->writer->Add(SaveInfo(save->checkpoint.info, *wall_));
    save->writer->Add(jobs::EncodeCheckpoint(save->checkpoint));
    const store::SnapshotFile file = save->writer->Commit();
    save->bytes = file.size;
    for (const auto& old :
         ledger_->AddSnapshot(save->job, {save->sequence, file, PassRows(save->checkpoint)},
                              save->final ? 1 : kSnapshotsKept)) {
        store_->Remove(old);
    }
}

// Those of jobs that are over, the oldest first, as far as they exceed the quota.
void FilmKeeper::DropOldFilms() {
    const auto films = ledger_->SnapshotsOfThoseOver();
    std::uint64_t bytes = 0;
    for (const auto& [job, size] : films) {
        bytes += size;
    }
    for (const auto& [job, size] : films) {
        if (bytes <= options_.quota) {
            return;
        }
        bytes -= size;
        for (const auto& file : ledger_->RemoveSnapshots(job)) {
            store_->Remove(file);
        }
    }
}

void FilmKeeper::Ended(const std::shared_ptr<Save>& save) {
    const LogScope scope({.job = save->job});
    const double seconds = save->control_seconds + save->seconds;
    const auto it = jobs_.find(save->job);
    if (save->error) {
        spdlog::error("{}: its film is not saved: {}", save->job, save->error->what());
        if (it != jobs_.end() && !save->final) {
            Kept& kept = it->second;
            kept.held = true;
            kept.due = clock_.Now() + FromSeconds(kRetrySeconds);
            kept.answers.insert(kept.answers.end(), save->answers.begin(), save->answers.end());
            hooks_.hold(save->job, save->error->what());
            SaveNext();
            return;
        }
    }
    if (!save->error) {
        spdlog::debug("{}: film saved, {} bytes, {:.3f} s of the server's time", save->job,
                      save->bytes, seconds);
    }
    if (queue_->Knows(save->job)) {
        queue_->CountSave(save->job, seconds);
    }
    for (const Answer& answer : save->answers) {
        hooks_.acknowledge(answer.worker, answer.ticket);
    }
    if (it != jobs_.end()) {
        it->second.due = std::max(it->second.due, clock_.Now() + FromSeconds(kShare * seconds));
        if (std::exchange(it->second.held, false)) {
            spdlog::info("{}: goes on, its film is saved again", save->job);
            hooks_.hold(save->job, "");
        }
    }
    SaveNext();
}

void FilmKeeper::Over(const std::string& job) {
    Abandon(job);
    const auto it = jobs_.find(job);
    if (it != jobs_.end()) {
        for (const Answer& answer : it->second.answers) {
            hooks_.acknowledge(answer.worker, answer.ticket);
        }
        jobs_.erase(it);
    }
    if (!stopped_ && options_.save_seconds > 0) {
        files_->Post([this] { DropOldFilms(); });
    }
}

void FilmKeeper::Answered(const std::string& job, std::uint64_t unit, jobs::WorkerId worker,
                          const std::string& ticket) {
    if (ticket.empty()) {
        return;
    }
    if (options_.save_seconds == 0) {
        hooks_.acknowledge(worker, ticket);
    } else {
        jobs_[job].answers.push_back({unit, worker, ticket});
    }
}

}  // namespace relume::server
