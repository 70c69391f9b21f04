#include "worker/loop/worker.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <future>
#include <set>

#include "core/base/error.h"
#include "core/base/files.h"
#include "core/film/aov.h"
#include "proto/codec/digests.h"
#include "proto/codec/protocol.h"
#include "tests/unit/jobs/pseudo_renderer.h"
#include "tests/unit/loop/fake_server.h"

namespace relume::worker {
namespace {

using testing::HasSubstr;
using testing::UnorderedElementsAre;

class WorkerTest : public testing::Test {
  protected:
    // Runs a worker of two threads on a scene of pseudo samples and takes its Hello.
    void Start() {
        WorkerOptions options;
        options.server = server.address();
        options.name = "tested";
        options.threads = 2;
        options.isa = "avx2";
        options.cache_folder = folder.path();
        worker = std::make_unique<Worker>(
            options,
            [this](const FileSource& files, const SceneManifest& manifest, const RenderSettings&) {
                if (files.Read(manifest.main) != "a scene") {
                    ThrowInvalidArgument("scene.gltf: byte 0: not glTF");
                }
                auto scene = std::make_shared<LoadedScene>();
                scene->notes.push_back("pretended");
                scene->render = [this](const TileTask& task, const CancelToken& cancel) {
                    if (task.first[0] == kEndless) {
                        ++begun;
                        begun.notify_all();
                        while (!cancel.cancelled()) {
                            std::this_thread::yield();
                        }
                        return TileResult();
                    }
                    if (task.first[0] == kFails) {
                        throw std::runtime_error("out of luck");
                    }
                    return PseudoRender(task);
                };
                return scene;
            });
        running = std::async(std::launch::async, [this] { worker->Run(); });
    }
    v1::WorkRequest TakeHello() {
        v1::WorkRequest message = server.Next();
        EXPECT_TRUE(message.has_hello());
        return message;
    }
    ~WorkerTest() override {
        if (worker) {
            worker->Stop();
            if (running.valid()) {
                running.wait();
            }
        }
    }

    static SceneManifest Manifest(const std::string& contents) {
        return {"scene.gltf", {{"scene.gltf", contents.size(), Sha256Hex(contents)}}};
    }
    static RenderSettings Settings() {
        RenderSettings settings;
        settings.width = settings.height = 64;
        return settings;
    }
    void SendJob(const std::string& job = "jobs/a", const std::string& contents = "a scene") {
        v1::WorkResponse message;
        message.mutable_job()->set_job(job);
        *message.mutable_job()->mutable_scene() = codec::ToProto(Manifest(contents));
        *message.mutable_job()->mutable_settings() = codec::ToProto(Settings());
        message.mutable_job()->mutable_channels()->Add(FilmChannelNames().begin(),
                                                       FilmChannelNames().end());
        server.Send(message);
    }
    TileTask SendLease(std::uint64_t id, std::uint32_t first = 0, const std::string& job = "jobs/a",
                       const std::string& ticket = "") {
        TileTask task;
        task.rect = {8, 16, 13, 19};
        task.first.assign(task.rect.area(), first);
        task.count.assign(task.rect.area(), 4);
        task.count[7] = 0;
        v1::WorkResponse message;
        codec::TaskToLease(task, message.mutable_lease());
        message.mutable_lease()->set_id(id);
        message.mutable_lease()->set_job(job);
        message.mutable_lease()->set_epoch(3);
        message.mutable_lease()->set_ticket(ticket);
        server.Send(message);
        return task;
    }
    // Collects lease ids that come back until there are so many.
    std::set<std::uint64_t> TakeReturned(std::size_t count) {
        std::set<std::uint64_t> ids;
        while (ids.size() < count) {
            const auto message = server.Next();
            EXPECT_TRUE(message.has_lease_return()) << message.ShortDebugString();
            const auto& returned = message.lease_return().lease_ids();
            ids.insert(returned.begin(), returned.end());
        }
        return ids;
    }
    void WaitUntilBegun(int count) {
        for (int now = begun; now < count; now = begun) {
            begun.wait(now);
        }
    }

    static constexpr std::uint32_t kEndless = 1000, kFails = 2000;
    FakeServer server;
    TemporaryFolder folder;
    std::atomic<int> begun{0};  // endless leases
    std::unique_ptr<Worker> worker;
    std::future<void> running;
};

TEST_F(WorkerTest, SaysWhoItIsAndWhatItWants) {
    Start();
    const v1::Hello hello = TakeHello().hello();
    EXPECT_EQ(hello.name(), "tested");
    EXPECT_EQ(hello.protocol_version(), kProtocolVersion);
    EXPECT_EQ(hello.numeric_class().build(), kBuild);
    EXPECT_EQ(hello.numeric_class().isa(), "avx2");
    EXPECT_EQ(hello.threads(), 2);
    const v1::WorkRequest report = server.Next(true);
    ASSERT_TRUE(report.has_report());
    EXPECT_GE(report.report().credits(), 2u);
    EXPECT_EQ(report.report().leases_held(), 0u);
    EXPECT_TRUE(server.Next(true).has_report());  // again and again
}

TEST_F(WorkerTest, FetchesTheSceneAndAnswersLeases) {
    server.AddBlob("a scene");
    Start();
    TakeHello();
    SendJob();
    const TileTask task = SendLease(11);
    const v1::WorkRequest ready = server.Next();
    ASSERT_TRUE(ready.has_scene_ready()) << ready.ShortDebugString();
    EXPECT_EQ(ready.scene_ready().job(), "jobs/a");
    EXPECT_EQ(ready.scene_ready().notes(0), "pretended");
    const v1::WorkRequest answer = server.Next();
    ASSERT_TRUE(answer.has_result());
    EXPECT_EQ(answer.result().lease_id(), 11u);
    EXPECT_EQ(answer.result().job(), "jobs/a");
    EXPECT_EQ(answer.result().epoch(), 3u);
    EXPECT_EQ(answer.result().rays(), 3 * task.TotalSamples());
    const TileResult rendered = PseudoRender(task);
    EXPECT_EQ(answer.result().planes(), codec::EncodePlanes(rendered));
    // What it understood, and what it computed.
    v1::LeaseResult due;
    const std::uint64_t context = codec::ContextDigest("jobs/a", Manifest("a scene"), Settings());
    codec::SetDigests(codec::TaskDigest(context, 0, task), rendered, &due);
    EXPECT_EQ(answer.result().task_digest(), due.task_digest());
    EXPECT_EQ(answer.result().checksum(), due.checksum());
    // The scene stays: the next lease is answered at once.
    SendLease(12);
    EXPECT_EQ(server.Next().result().lease_id(), 12u);
}

TEST_F(WorkerTest, ASceneThatDoesNotLoadIsSaidAndItsLeasesGoBack) {
    server.AddBlob("not a scene");
    Start();
    TakeHello();
    SendJob("jobs/a", "not a scene");
    SendLease(1);
    const v1::WorkRequest problem = server.Next();
    ASSERT_TRUE(problem.has_problem());
    EXPECT_EQ(problem.problem().message(), "scene.gltf: byte 0: not glTF");
    EXPECT_FALSE(problem.problem().transient());
    EXPECT_THAT(TakeReturned(1), UnorderedElementsAre(1));
}

TEST_F(WorkerTest, ALeaseThatFailsIsSaidAndGoesBack) {
    server.AddBlob("a scene");
    Start();
    TakeHello();
    SendJob();
    SendLease(1, kFails);
    EXPECT_TRUE(server.Next().has_scene_ready());
    const v1::WorkRequest problem = server.Next();
    ASSERT_TRUE(problem.has_problem());
    EXPECT_EQ(problem.problem().message(), "out of luck");
    EXPECT_TRUE(problem.problem().transient());
    EXPECT_THAT(TakeReturned(1), UnorderedElementsAre(1));
}

TEST_F(WorkerTest, WhatMakesNoSenseIsAnsweredAndTheWorkerLives) {
    server.AddBlob("a scene");
    Start();
    TakeHello();
    SendLease(1, 0, "jobs/unknown");
    EXPECT_THAT(TakeReturned(1), UnorderedElementsAre(1));
    SendJob();
    v1::WorkResponse message;
    message.mutable_lease()->set_id(2);
    message.mutable_lease()->set_job("jobs/a");
    message.mutable_lease()->mutable_rect()->set_x1(1 << 30);
    message.mutable_lease()->mutable_rect()->set_y1(1 << 30);
    server.Send(message);
    // Not the job's fault: it was damaged on its way.
    EXPECT_TRUE(server.Next().problem().transient());
    EXPECT_THAT(TakeReturned(1), UnorderedElementsAre(2));
    message.Clear();
    message.mutable_job()->set_job("jobs/b");  // without a scene, size or channels
    server.Send(message);
    EXPECT_EQ(server.Next().problem().job(), "jobs/b");
    message.Clear();
    message.mutable_revoke()->add_lease_ids(77);
    server.Send(message);
    server.Send(v1::WorkResponse());
    SendLease(3);
    EXPECT_TRUE(server.Next().has_scene_ready());
    EXPECT_EQ(server.Next().result().lease_id(), 3u);
}

TEST_F(WorkerTest, RevokedLeasesEndAndMakeRoom) {
    server.AddBlob("a scene");
    Start();
    TakeHello();
    SendJob();
    for (const std::uint64_t id : {1, 2, 3}) {
        SendLease(id, kEndless);
    }
    EXPECT_TRUE(server.Next().has_scene_ready());
    WaitUntilBegun(2);  // both threads; the third waits
    v1::WorkResponse message;
    for (const std::uint64_t id : {1, 2, 3}) {
        message.mutable_revoke()->add_lease_ids(id);
    }
    server.Send(message);
    EXPECT_THAT(TakeReturned(3), UnorderedElementsAre(1, 2, 3));
    SendLease(4);
    EXPECT_EQ(server.Next().result().lease_id(), 4u);
}

TEST_F(WorkerTest, AJobThatIsOverIsForgotten) {
    server.AddBlob("a scene");
    Start();
    TakeHello();
    SendJob();
    SendLease(1);
    EXPECT_TRUE(server.Next().has_scene_ready());
    EXPECT_TRUE(server.Next().has_result());
    v1::WorkResponse message;
    message.mutable_job_over()->set_job("jobs/a");
    server.Send(message);
    SendLease(2);
    EXPECT_THAT(TakeReturned(1), UnorderedElementsAre(2));
    SendJob();  // there is work again
    SendLease(3);
    EXPECT_TRUE(server.Next().has_scene_ready());
    EXPECT_EQ(server.Next().result().lease_id(), 3u);
}

TEST_F(WorkerTest, StopHandsBackAndLeaves) {
    server.AddBlob("a scene");
    Start();
    TakeHello();
    SendJob();
    for (const std::uint64_t id : {1, 2, 3, 4}) {
        SendLease(id, kEndless);
    }
    EXPECT_TRUE(server.Next().has_scene_ready());
    WaitUntilBegun(2);
    worker->Stop();
    EXPECT_THAT(TakeReturned(4), UnorderedElementsAre(1, 2, 3, 4));
    server.WaitForGoodbye();
    running.get();
}

TEST_F(WorkerTest, AServersDrainLetsRunningLeasesFinish) {
    server.AddBlob("a scene");
    Start();
    TakeHello();
    SendJob();
    SendLease(1);
    v1::WorkResponse message;
    message.mutable_drain();
    server.Send(message);
    // The lease is answered or handed back, whichever it came to.
    for (auto answer = server.Next(); !answer.has_result(); answer = server.Next()) {
        if (answer.has_lease_return()) {
            break;
        }
    }
    server.WaitForGoodbye();
    running.get();  // for good
}

TEST_F(WorkerTest, ComesBackToAServerThatRestarts) {
    server.AddBlob("a scene");
    Start();
    TakeHello();
    v1::WorkResponse message;
    message.mutable_drain()->set_come_back(true);
    server.Send(message);
    TakeHello();
    SendJob();
    SendLease(5);
    EXPECT_TRUE(server.Next().has_scene_ready());
    EXPECT_EQ(server.Next().result().lease_id(), 5u);
}

TEST_F(WorkerTest, ALostConnectionIsMadeAgainAndItsLeasesForgotten) {
    server.AddBlob("a scene");
    Start();
    TakeHello();
    SendJob();
    SendLease(1, kEndless);
    SendLease(2, kEndless);
    SendLease(3, kEndless);
    EXPECT_TRUE(server.Next().has_scene_ready());
    WaitUntilBegun(2);
    server.Break();
    TakeHello();
    SendJob("jobs/b");
    SendLease(1, 0, "jobs/b");  // of the same number as one before
    EXPECT_TRUE(server.Next().has_scene_ready());
    EXPECT_EQ(server.Next().result().lease_id(), 1u);
}

TEST_F(WorkerTest, WhatIsNotAcknowledgedIsHandedInAgain) {
    server.AddBlob("a scene");
    Start();
    TakeHello();
    SendJob();
    SendLease(1, 0, "jobs/a", "ticket-1");
    EXPECT_TRUE(server.Next().has_scene_ready());
    const v1::WorkRequest first = server.Next();
    EXPECT_EQ(first.result().ticket(), "ticket-1");
    SendLease(2, 4, "jobs/a", "ticket-2");
    EXPECT_EQ(server.Next().result().ticket(), "ticket-2");
    v1::WorkResponse message;
    message.mutable_acknowledge()->add_tickets("ticket-2");
    server.Send(message);
    SendLease(3, 8);  // without a ticket: an answer that is not kept
    EXPECT_EQ(server.Next().result().lease_id(), 3u);
    server.Break();
    TakeHello();
    EXPECT_EQ(server.Next().SerializeAsString(), first.SerializeAsString());
    message.mutable_acknowledge()->set_tickets(0, "ticket-1");
    server.Send(message);
    SendJob();
    SendLease(4);
    EXPECT_TRUE(server.Next().has_scene_ready());
    EXPECT_EQ(server.Next().result().lease_id(), 4u);
    server.Break();
    TakeHello();
    EXPECT_TRUE(server.Next(true).has_report());  // and nothing before it
}

TEST_F(WorkerTest, AServerThatIsNotThereYetIsWaitedFor) {
    server.RefuseWith({grpc::StatusCode::UNAVAILABLE, "starting"});
    Start();
    TakeHello();
}

TEST_F(WorkerTest, ARefusalEndsItWithTheReason) {
    server.RefuseWith({grpc::StatusCode::FAILED_PRECONDITION, "the worker is of 1999"});
    Start();
    try {
        running.get();
        FAIL() << "it stays";
    } catch (const Error& error) {
        EXPECT_EQ(error.code(), ErrorCode::kFailedPrecondition);
        EXPECT_THAT(error.what(), HasSubstr("the worker is of 1999"));
        EXPECT_THAT(error.what(), HasSubstr(server.address()));
        EXPECT_THAT(error.what(), HasSubstr(kBuild));
    }
}

TEST_F(WorkerTest, WhoIsNotLetInAtFirstEndsAndWhoWasOnceComesBack) {
    for (const auto code :
         {grpc::StatusCode::PERMISSION_DENIED, grpc::StatusCode::UNAUTHENTICATED}) {
        server.RefuseWith({code, "not you"});
        Start();
        try {
            running.get();
            FAIL() << "it stays";
        } catch (const Error& error) {
            EXPECT_THAT(error.what(), HasSubstr("not you"));
            EXPECT_THAT(error.what(), HasSubstr(server.address()));
        }
    }
    Start();
    TakeHello();
    EXPECT_TRUE(server.Next(true).has_report());  // so it was welcomed
    server.RefuseWith({grpc::StatusCode::PERMISSION_DENIED, "not now"});
    server.Break();
    TakeHello();
}

TEST_F(WorkerTest, AJoinTokenDoesNotCrossANetworkInTheClear) {
    WorkerOptions options;
    options.cache_folder = folder.path();
    options.join_token = "0123456789abcdef";
    for (const char* address : {"farm:7878", "10.0.0.1:7878", "dns:///localhost:1", "unix:x"}) {
        options.server = address;
        EXPECT_THROW(Worker(options, {}), Error) << address;
    }
    options.server = "127.0.0.1:1";
    EXPECT_NO_THROW(Worker(options, {}));
}

TEST_F(WorkerTest, StopsWhileTheServerIsAway) {
    WorkerOptions options;
    options.server = "127.0.0.1:1";  // nobody
    options.name = "lonely";
    options.cache_folder = folder.path();
    Worker lonely(options, {});
    auto run = std::async(std::launch::async, [&] { lonely.Run(); });
    lonely.Stop();
    run.get();
}

}  // namespace
}  // namespace relume::worker
