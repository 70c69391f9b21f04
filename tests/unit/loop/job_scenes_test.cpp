#include "worker/loop/job_scenes.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <atomic>
#include <condition_variable>
#include <deque>
#include <functional>
#include <set>

#include "core/base/files.h"
#include "tests/unit/loop/fake_blobs.h"

namespace relume::worker {
namespace {

using testing::HasSubstr;

class JobScenesTest : public testing::Test {
  protected:
    struct Call {
        std::string job, message;
        bool ready = false, transient = false;
        std::shared_ptr<const LoadedScene> scene;
    };

    // `loader` may be left out: it makes a scene whose note is what the main file says.
    JobScenes Make(SceneLoader loader = {}) {
        if (!loader) {
            loader = [this](const FileSource& files, const SceneManifest& manifest,
                            const RenderSettings&) {
                ++loads;
                auto scene = std::make_shared<LoadedScene>();
                scene->notes.push_back(files.Read(manifest.main));
                return scene;
            };
        }
        JobScenes::Handler handler;
        handler.on_ready = [this](const std::string& job, std::shared_ptr<const LoadedScene> scene,
                                  double) {
            Record({job, "", true, false, std::move(scene)});
        };
        handler.on_problem = [this](const std::string& job, const std::string& message,
                                    bool transient) {
            Record({job, message, false, transient, nullptr});
        };
        return JobScenes(&cache, blobs.Fetch(), std::move(loader), std::move(handler));
    }
    void Record(Call call) {
        const std::lock_guard lock(mutex);
        calls.push_back(std::move(call));
        changed.notify_all();
    }
    Call Next() {
        std::unique_lock lock(mutex);
        changed.wait(lock, [this] { return !calls.empty(); });
        Call call = std::move(calls.front());
        calls.pop_front();
        return call;
    }
    SceneManifest Scene(const std::string& contents) {
        return {"scene.gltf", {blobs.AddFile("scene.gltf", contents)}};
    }

    TemporaryFolder folder;
    FakeBlobs blobs;
    BlobCache cache{folder.path(), 1 << 20};
    RenderSettings settings;
    std::atomic<int> loads{0};
    std::mutex mutex;  // guards calls
    std::condition_variable changed;
    std::deque<Call> calls;
};

TEST_F(JobScenesTest, LoadsOnceAndHandsOutAtOnceAfterwards) {
    auto scenes = Make();
    EXPECT_FALSE(scenes.Knows("jobs/a"));
    EXPECT_EQ(scenes.Want("jobs/a"), nullptr);
    scenes.Add("jobs/a", Scene("one"), settings);
    EXPECT_TRUE(scenes.Knows("jobs/a"));
    EXPECT_EQ(scenes.Want("jobs/a"), nullptr);
    const Call call = Next();
    EXPECT_EQ(call.job, "jobs/a");
    ASSERT_TRUE(call.ready) << call.message;
    EXPECT_EQ(call.scene->notes.at(0), "one");
    EXPECT_EQ(scenes.Want("jobs/a"), call.scene);
    EXPECT_EQ(loads, 1);
}

TEST_F(JobScenesTest, JobsOfEqualSceneAndSettingsShareIt) {
    auto scenes = Make();
    RenderSettings other = settings;
    other.seed = 9;
    scenes.Add("jobs/a", Scene("one"), settings);
    scenes.Add("jobs/b", Scene("one"), settings);
    scenes.Add("jobs/c", Scene("one"), other);
    scenes.Want("jobs/a");
    const Call a = Next();
    scenes.Want("jobs/b");
    const Call b = Next();  // told as well, for its notes
    EXPECT_EQ(b.job, "jobs/b");
    EXPECT_EQ(a.scene, b.scene);
    EXPECT_EQ(loads, 1);
    scenes.Want("jobs/c");
    EXPECT_NE(Next().scene, a.scene);
    EXPECT_EQ(loads, 2);
}

TEST_F(JobScenesTest, ASecondJobOnAScenesBuildsNothing) {
    int builds = 0, views = 0;
    std::function<std::shared_ptr<const LoadedScene>(const RenderSettings&)> view =
        [&](const RenderSettings& s) {
            ++views;
            auto scene = std::make_shared<LoadedScene>();
            scene->notes.push_back(std::to_string(s.seed));
            scene->view = view;
            return scene;
        };
    auto scenes = Make([&](const FileSource&, const SceneManifest&, const RenderSettings& s) {
        ++builds;
        return view(s);
    });
    // Size, seed, depth, camera and lens are a view's own.
    std::vector<RenderSettings> all(8, settings);
    all[1].seed = 9;
    all[2].width = 77;
    all[3].camera = "side";
    all[4].look = LookCamera{{1, 2, 3}, {0, 0, 0}};
    all[5].max_depth = 3;
    all[6].lens_radius = 1;
    all[7].crop = {0, 0, 1, 1};
    std::set<std::shared_ptr<const LoadedScene>> different;
    for (std::size_t i = 0; i < all.size(); ++i) {
        const std::string job = "jobs/" + std::to_string(i);
        scenes.Add(job, Scene("one"), all[i]);
        scenes.Want(job);
        const Call call = Next();
        ASSERT_TRUE(call.ready);
        EXPECT_EQ(call.scene->notes.at(0), std::to_string(all[i].seed));
        EXPECT_EQ(scenes.Want(job), call.scene);
        different.insert(call.scene);
    }
    EXPECT_EQ(builds, 1);
    EXPECT_EQ(views, 8);
    EXPECT_EQ(different.size(), all.size());
    // Another environment is another scene.
    RenderSettings lit = settings;
    lit.environment = "sky.hdr";
    scenes.Add("jobs/lit", Scene("one"), lit);
    scenes.Want("jobs/lit");
    EXPECT_TRUE(Next().ready);
    EXPECT_EQ(builds, 2);
    // The first ones are still there.
    scenes.Add("jobs/again", Scene("one"), all[1]);
    scenes.Want("jobs/again");
    EXPECT_TRUE(different.count(Next().scene) == 1);
    EXPECT_EQ(views, 9);
}

// Another time of a scene that is kept is made of that; what can't be is loaded.
TEST_F(JobScenesTest, FramesOfASceneShareWhatIsLoaded) {
    std::atomic<int> frames{0};
    bool can = true;
    auto scenes = Make([&](const FileSource&, const SceneManifest&, const RenderSettings&) {
        ++loads;
        auto scene = std::make_shared<LoadedScene>();
        scene->frame = [&](const FileSource& files, const RenderSettings& at) {
            EXPECT_EQ(files.Read("scene.gltf"), "one");
            ++frames;
            auto frame = can ? std::make_shared<LoadedScene>() : nullptr;
            if (frame) {
                frame->notes.push_back(std::to_string(at.time));
            }
            return frame;
        };
        return scene;
    });
    const auto load = [&](const std::string& job, const std::string& contents, float time) {
        RenderSettings at = settings;
        at.time = time;
        scenes.Add(job, Scene(contents), at);
        scenes.Want(job);
        return Next().scene;
    };
    const auto first = load("jobs/a", "one", 0.5f);
    EXPECT_EQ(frames, 0);
    const auto second = load("jobs/b", "one", 0.75f);
    EXPECT_EQ(second->notes.at(0), std::to_string(0.75f));
    EXPECT_NE(second, first);
    EXPECT_EQ(load("jobs/c", "one", 0.5f), first);
    EXPECT_EQ(loads, 1);
    EXPECT_EQ(frames, 1);
    // Another scene has nothing in common with it.
    load("jobs/d", "two", 1);
    EXPECT_EQ(loads, 2);
    EXPECT_EQ(frames, 1);
    can = false;
    load("jobs/e", "one", 1.25f);
    EXPECT_EQ(loads, 3);
    EXPECT_EQ(frames, 2);
}

TEST_F(JobScenesTest, AReconnectKeepsTheScenesAndForgetsTheJobs) {
    auto scenes = Make();
    scenes.Add("jobs/a", Scene("one"), settings);
    scenes.Add("jobs/b", Scene("one"), settings);
    scenes.Want("jobs/a");
    Next();
    scenes.Forget("jobs/b");
    EXPECT_FALSE(scenes.Knows("jobs/b"));
    EXPECT_TRUE(scenes.Knows("jobs/a"));
    scenes.ForgetJobs();
    EXPECT_FALSE(scenes.Knows("jobs/a"));
    scenes.Add("jobs/x", Scene("one"), settings);
    scenes.Want("jobs/x");
    EXPECT_TRUE(Next().ready);
    EXPECT_EQ(loads, 1);
}

TEST_F(JobScenesTest, ASceneThatIsWrongIsNobodysFaultButItsOwn) {
    auto scenes = Make([](const FileSource&, const SceneManifest&,
                          const RenderSettings&) -> std::shared_ptr<const LoadedScene> {
        ThrowInvalidArgument("scene.gltf: byte 12: not glTF");
    });
    scenes.Add("jobs/a", Scene("one"), settings);
    scenes.Want("jobs/a");
    const Call call = Next();
    EXPECT_FALSE(call.ready);
    EXPECT_FALSE(call.transient);
    EXPECT_EQ(call.message, "scene.gltf: byte 12: not glTF");
}

TEST_F(JobScenesTest, WhatAnotherWorkerMayDoBetterIsTransient) {
    int attempt = 0;
    auto scenes = Make([&](const FileSource&, const SceneManifest&,
                           const RenderSettings&) -> std::shared_ptr<const LoadedScene> {
        if (attempt++ == 0) {
            throw std::bad_alloc();
        }
        throw Error(ErrorCode::kResourceExhausted, "disk full");
    });
    scenes.Add("jobs/a", Scene("one"), settings);
    scenes.Add("jobs/b", Scene("two"), settings);
    scenes.Want("jobs/a");
    Call call = Next();
    EXPECT_TRUE(call.transient);
    EXPECT_THAT(call.message, HasSubstr("memory"));
    scenes.Want("jobs/b");
    call = Next();
    EXPECT_TRUE(call.transient);
    EXPECT_EQ(call.message, "disk full");
}

TEST_F(JobScenesTest, AKeptSceneMakesRoomForOneThatNeedsItsMemory) {
    std::weak_ptr<const LoadedScene> kept;
    int attempts = 0;
    auto scenes = Make([&](const FileSource&, const SceneManifest&,
                           const RenderSettings&) -> std::shared_ptr<const LoadedScene> {
        ++attempts;
        if (!kept.expired()) {
            throw std::bad_alloc();
        }
        auto scene = std::make_shared<LoadedScene>();
        kept = scene;
        return scene;
    });
    scenes.Add("jobs/a", Scene("one"), settings);
    scenes.Want("jobs/a");
    EXPECT_TRUE(Next().ready);
    scenes.Forget("jobs/a");
    scenes.Add("jobs/b", Scene("two"), settings);
    scenes.Want("jobs/b");
    EXPECT_TRUE(Next().ready);
    EXPECT_EQ(attempts, 3);
}

TEST_F(JobScenesTest, ATransferThatBreaksIsTransientAMissingFileIsNot) {
    auto scenes = Make();
    const SceneManifest broken = Scene(std::string(500, 'x'));
    blobs.BreakAfter({100});
    scenes.Add("jobs/a", broken, settings);
    scenes.Want("jobs/a");
    EXPECT_TRUE(Next().transient);
    scenes.Add("jobs/b", {"scene.gltf", {{"scene.gltf", 4, Sha256Hex("gone")}}}, settings);
    scenes.Want("jobs/b");
    EXPECT_FALSE(Next().transient);
    EXPECT_EQ(loads, 0);
}

}  // namespace
}  // namespace relume::worker
