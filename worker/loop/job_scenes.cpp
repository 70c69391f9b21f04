#include "worker/loop/job_scenes.h"

#include <fmt/format.h>
#include <malloc.h>

#include <algorithm>
#include <new>
#include <utility>

#include "core/base/error.h"
#include "core/base/log.h"
#include "core/base/resources.h"
#include "proto/codec/codec.h"
#include "worker/loop/crash_report.h"
#include "worker/loop/manifest_source.h"

namespace relume::worker {
namespace {

constexpr std::size_t kKeptScenes = 2, kKeptViews = 16;
constexpr double kMaxBackoffSeconds = 60;

// The one of this key, moved to the front; the end if there is none.
template <class List>
auto FindFirst(List* list, const std::string& key) {
    const auto it = std::find_if(list->begin(), list->end(),
                                 [&](const auto& item) { return item.first == key; });
    if (it != list->end()) {
        list->splice(list->begin(), *list, it);
    }
    return it;
}

std::string NeedsMemory() {
    const auto limit = DataLimit();
    return limit ? fmt::format(
                       "the scene needs more than the {:.3g} GB that this worker may take; "
                       "give it more (--memory-limit), or a machine that has more",
                       static_cast<double>(*limit) * 1e-9)
                 : "the scene needs more memory than there is; render on a machine with more";
}

// Would another worker, or a later attempt, do better?
bool IsTransient(ErrorCode code, bool fetching) {
    switch (code) {
        case ErrorCode::kResourceExhausted:
        case ErrorCode::kUnavailable:
        case ErrorCode::kDeadlineExceeded:
        case ErrorCode::kCancelled:
            return true;
        case ErrorCode::kNotFound:
        case ErrorCode::kInvalidArgument:
            return false;
        default:
            return fetching;  // this machine's disk, this transfer
    }
}

}  // namespace

JobScenes::JobScenes(BlobCache* cache, BlobFetch fetch, SceneLoader loader, Handler handler)
    : cache_(cache),
      fetch_(std::move(fetch)),
      loader_(std::move(loader)),
      handler_(std::move(handler)),
      thread_([this] { LoadThread(); }) {}

JobScenes::~JobScenes() {
    {
        const std::lock_guard lock(mutex_);
        stop_ = true;
        changed_.notify_all();
    }
    thread_.join();
}

void JobScenes::Add(const std::string& job, const SceneManifest& manifest,
                    const RenderSettings& settings) {
    const std::lock_guard lock(mutex_);
    Entry entry;
    entry.manifest = manifest;
    entry.settings = settings;
    entry.build_key = BuildKey(manifest, settings);
    entry.frame_key = FrameKey(manifest, settings);
    entry.view_key = codec::ToProto(settings).SerializeAsString();
    jobs_.insert_or_assign(job, std::move(entry));
}

bool JobScenes::Knows(const std::string& job) const {
    const std::lock_guard lock(mutex_);
    return jobs_.count(job) != 0;
}

std::shared_ptr<const LoadedScene> JobScenes::Want(const std::string& job) {
    const std::lock_guard lock(mutex_);
    const auto it = jobs_.find(job);
    if (it == jobs_.end()) {
        return nullptr;
    }
    // A job's first lease always goes through the loading thread, so that SceneReady tells its
    // notes.
    if (it->second.announced) {
        if (auto scene = Find(it->second)) {
            return scene;
        }
    }
    it->second.wanted = true;
    changed_.notify_all();
    return nullptr;
}

void JobScenes::Forget(const std::string& job) {
    const std::lock_guard lock(mutex_);
    jobs_.erase(job);
}

void JobScenes::ForgetJobs() {
    const std::lock_guard lock(mutex_);
    jobs_.clear();
    ++generation_;
}

bool JobScenes::busy() const {
    const std::lock_guard lock(mutex_);
    return busy_;
}

void JobScenes::LoadThread() {
    std::unique_lock lock(mutex_);
    while (!stop_) {
        // The wanted job whose time comes first.
        const auto it =
            std::min_element(jobs_.begin(), jobs_.end(), [](const auto& a, const auto& b) {
                return std::pair(!a.second.wanted, a.second.not_before) <
                       std::pair(!b.second.wanted, b.second.not_before);
            });
        if (it == jobs_.end() || !it->second.wanted) {
            changed_.wait(lock);
            continue;
        }
        if (it->second.not_before > SteadyClock().Now()) {
            const TimePoint wake = it->second.not_before;
            changed_.wait_until(lock, wake);
            continue;
        }
        const std::string job = it->first;
        const Entry entry = it->second;
        const std::uint64_t generation = generation_;
        busy_ = true;
        lock.unlock();
        Load(job, entry, generation);
        lock.lock();
        busy_ = false;
    }
}

void JobScenes::Load(const std::string& job, const Entry& entry, std::uint64_t generation) {
    const TimePoint begin = SteadyClock().Now();
    std::shared_ptr<const LoadedScene> scene, built, frame;
    {
        const std::lock_guard lock(mutex_);
        scene = Find(entry);
        built = scene ? nullptr : FindBuilt(entry);
        frame = scene || built ? nullptr : FindFrame(entry);
    }
    std::string problem;
    bool transient = false;
    bool fetching = true;
    try {
        const CrashScope crash_scope(job, 0);
        if (built && built->view) {
            fetching = false;
            scene = built->view(entry.settings);
        } else if (!scene) {
            const ManifestSource files(entry.manifest, cache_, fetch_);
            files.FetchAll();
            fetching = false;
            if (frame && frame->frame) {
                scene = frame->frame(files, entry.settings);
            }
            if (!scene) {
                scene = LoadWithRoom(files, entry);
            }
        }
    } catch (const Error& error) {
        problem = error.what();
        transient = IsTransient(error.code(), fetching);
    } catch (const std::bad_alloc&) {
        problem = entry.manifest.main + ": " + NeedsMemory();
        transient = true;
    } catch (const std::exception& error) {
        problem = fmt::format("{}: {}", entry.manifest.main, error.what());
    }

    {
        const std::lock_guard lock(mutex_);
        if (scene) {
            Keep(entry, scene);
        }
        const auto it = jobs_.find(job);
        if (generation != generation_ || it == jobs_.end()) {
            return;
        }
        it->second.wanted = false;
        if (scene) {
            it->second.announced = true;
        } else {
            it->second.not_before = SteadyClock().Now() + FromSeconds(entry.backoff_seconds);
            it->second.backoff_seconds = std::min(2 * entry.backoff_seconds, kMaxBackoffSeconds);
        }
    }
    if (scene) {
        handler_.on_ready(job, scene, ToSeconds(SteadyClock().Now() - begin));
    } else {
        handler_.on_problem(job, problem, transient);
    }
}

std::shared_ptr<const LoadedScene> JobScenes::LoadWithRoom(const FileSource& files,
                                                           const Entry& entry) {
    try {
        return loader_(files, entry.manifest, entry.settings);
    } catch (const std::bad_alloc&) {
        if (!DropKept()) {
            throw;
        }
    } catch (const Error& error) {
        if (error.code() != ErrorCode::kResourceExhausted || !DropKept()) {
            throw;
        }
    }
    return loader_(files, entry.manifest, entry.settings);
}

bool JobScenes::DropKept() {
    decltype(kept_) dropped;
    {
        const std::lock_guard lock(mutex_);
        dropped.swap(kept_);
    }
    const bool any = !dropped.empty();
    dropped.clear();
    malloc_trim(0);
    return any;
}

void JobScenes::Keep(const Entry& entry, std::shared_ptr<const LoadedScene> scene) {
    if (FindFirst(&kept_, entry.build_key) == kept_.end()) {
        kept_.emplace_front(entry.build_key, Built{entry.frame_key, {}});
        if (kept_.size() > kKeptScenes) {
            kept_.pop_back();
        }
    }
    Views& views = kept_.front().second.views;
    if (FindFirst(&views, entry.view_key) == views.end()) {
        views.emplace_front(entry.view_key, std::move(scene));
        if (views.size() > kKeptViews) {
            views.pop_back();
        }
    }
}

std::shared_ptr<const LoadedScene> JobScenes::Find(const Entry& entry) {
    const auto built = FindFirst(&kept_, entry.build_key);
    if (built == kept_.end()) {
        return nullptr;
    }
    Views& views = built->second.views;
    const auto view = FindFirst(&views, entry.view_key);
    return view == views.end() ? nullptr : view->second;
}

std::shared_ptr<const LoadedScene> JobScenes::FindBuilt(const Entry& entry) const {
    const auto built = std::find_if(kept_.begin(), kept_.end(), [&](const auto& kept) {
        return kept.first == entry.build_key;
    });
    return built == kept_.end() ? nullptr : built->second.views.front().second;
}

std::shared_ptr<const LoadedScene> JobScenes::FindFrame(const Entry& entry) const {
    const auto built = std::find_if(kept_.begin(), kept_.end(), [&](const auto& kept) {
        return kept.second.frame_key == entry.frame_key;
    });
    return built == kept_.end() ? nullptr : built->second.views.front().second;
}

}  // namespace relume::worker
