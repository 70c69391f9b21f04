#pragma once

#include <condition_variable>
#include <cstdint>
#include <functional>
#include <list>
#include <map>
#include <memory>
#include <mutex>
#include <string>
#include <thread>
#include <utility>

#include "core/base/clock.h"
#include "core/scene/manifest.h"
#include "core/scene/render_settings.h"
#include "worker/loop/blob_cache.h"
#include "worker/loop/scene_loader.h"

namespace relume::worker {

// The scenes of the jobs that a worker was told of, loaded one at a time on a thread of its own,
// the last few kept by content: jobs on one scene share what was built of it, those with equal
// settings all. Thread-safe.
class JobScenes {
  public:
    struct Handler {  // called on the loading thread
        std::function<void(const std::string& job, std::shared_ptr<const LoadedScene>,
                           double seconds)>
            on_ready;
        // Transient: another worker, or this one later, may do better (disk full, out of memory).
        std::function<void(const std::string& job, const std::string& message, bool transient)>
            on_problem;
    };

    // `cache` outlives the object.
    JobScenes(BlobCache* cache, BlobFetch fetch, SceneLoader loader, Handler handler);
    ~JobScenes();  // waits for a load that has begun

    // Makes a job known. Later calls for the same job replace it.
    void Add(const std::string& job, const SceneManifest& manifest, const RenderSettings& settings);
    bool Knows(const std::string& job) const;
    // The job's scene, or null: then it is loaded, and one of the handlers will be called. After a
    // transient problem the next attempt waits, 2 s at first and up to a minute.
    std::shared_ptr<const LoadedScene> Want(const std::string& job);
    // Forgets a job that is over, but keeps its scene.
    void Forget(const std::string& job);
    // Forgets the jobs (their stream is gone) but keeps the scenes.
    void ForgetJobs();
    // True while a load is under way.
    bool busy() const;

  private:
    struct Entry {
        SceneManifest manifest;
        RenderSettings settings;
        std::string build_key;  // see BuildKey
        std::string frame_key;  // see FrameKey
        std::string view_key;   // of the settings: with both equal, scenes are equal
        bool wanted = false;
        bool announced = false;      // on_ready was called once
        TimePoint not_before{};      // of the next attempt
        double backoff_seconds = 2;  // after the next transient problem
    };

    void LoadThread();
    // Loads and reports; takes no lock while it loads.
    void Load(const std::string& job, const Entry& entry, std::uint64_t generation);
    // By the loader; if memory is short, once more without the scenes that are kept.
    std::shared_ptr<const LoadedScene> LoadWithRoom(const FileSource& files, const Entry& entry);
    // False if there were none.
    bool DropKept();
    void Keep(const Entry& entry, std::shared_ptr<const LoadedScene> scene);
    // The job's scene if it is kept; moves it to the front.
    std::shared_ptr<const LoadedScene> Find(const Entry& entry);
    // Any view of the job's scene.
    std::shared_ptr<const LoadedScene> FindBuilt(const Entry& entry) const;
    // Any view of it at another time.
    std::shared_ptr<const LoadedScene> FindFrame(const Entry& entry) const;

    BlobCache* cache_;
    BlobFetch fetch_;
    SceneLoader loader_;
    Handler handler_;

    mutable std::mutex mutex_;  // guards all below
    std::condition_variable changed_;
    std::map<std::string, Entry> jobs_;
    // Views by their key, last used first.
    using Views = std::list<std::pair<std::string, std::shared_ptr<const LoadedScene>>>;
    struct Built {
        std::string frame_key;
        Views views;
    };
    std::list<std::pair<std::string, Built>> kept_;  // by build key, last used first
    std::uint64_t generation_ = 0;  // rises with ForgetJobs: loads begun before report to nobody
    bool busy_ = false;
    bool stop_ = false;
    std::thread thread_;
};

}  // namespace relume::worker
