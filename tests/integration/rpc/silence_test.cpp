// When a worker is taken for gone: by what was received, not by what the server came to.
#include <grpcpp/create_channel.h>
#include <grpcpp/security/credentials.h>
#include <grpcpp/security/server_credentials.h>
#include <grpcpp/server_builder.h>
#include <gtest/gtest.h>

#include <chrono>
#include <future>
#include <thread>

#include "core/base/files.h"
#include "server/rpc/access.h"
#include "server/rpc/coordinator.h"
#include "server/rpc/work_service.h"
#include "tests/integration/rpc/hand.h"

namespace relume::server {
namespace {

constexpr double kSilence = 0.3;
constexpr double kPatience = 20;
constexpr std::chrono::milliseconds kStep{10};

class SilenceTest : public testing::Test {
  protected:
    SilenceTest() {
        CoordinatorOptions options;
        options.data = folder.path();
        options.silent_seconds = kSilence;
        coordinator = std::make_unique<Coordinator>(options);
        service = std::make_unique<WorkService>(coordinator.get(), &access);
        int port = 0;
        grpc::ServerBuilder builder;
        builder.AddListeningPort("127.0.0.1:0", grpc::InsecureServerCredentials(), &port);
        builder.RegisterService(service.get());
        server = builder.BuildAndStart();
        stub = v1::WorkerService::NewStub(grpc::CreateChannel("127.0.0.1:" + std::to_string(port),
                                                              grpc::InsecureChannelCredentials()));
    }
    ~SilenceTest() override {
        server->Shutdown(std::chrono::system_clock::now());
        server->Wait();
    }

    // On the control thread.
    std::uint64_t Silent() {
        return coordinator->queue().Status(coordinator->Now(), 9, 9).workers_silent;
    }
    std::uint64_t AskSilent() {
        std::promise<std::uint64_t> count;
        coordinator->control().Post([&] { count.set_value(Silent()); });
        return count.get_future().get();
    }

    TemporaryFolder folder;
    Access access{false, "", 16};
    std::unique_ptr<Coordinator> coordinator;
    std::unique_ptr<WorkService> service;
    std::unique_ptr<grpc::Server> server;
    std::unique_ptr<v1::WorkerService::Stub> stub;
};

TEST_F(SilenceTest, WhatWaitsToBeHandledIsNoSilence) {
    WorkerHand hand(stub.get());
    ASSERT_TRUE(hand.IsWelcome());
    std::promise<void> busy;
    std::promise<std::uint64_t> silent;
    coordinator->control().Post([&] {
        busy.set_value();
        const TimePoint start = coordinator->Now();
        const auto gone = [&] { return ToSeconds(coordinator->Now() - start); };
        // Until the report has come as well as the task below, and the worker would be silent.
        while (gone() < kPatience &&
               (coordinator->control().waiting() < 2 || gone() < 2 * kSilence)) {
            std::this_thread::sleep_for(kStep);
        }
    });
    busy.get_future().wait();
    coordinator->control().Post([&] { silent.set_value(Silent()); });
    hand.Want(1);
    EXPECT_EQ(silent.get_future().get(), 0u);
}

TEST_F(SilenceTest, WhoSaysNothingIsSilent) {
    WorkerHand hand(stub.get());
    ASSERT_TRUE(hand.IsWelcome());
    const TimePoint start = coordinator->Now();
    while (AskSilent() == 0 && ToSeconds(coordinator->Now() - start) < kPatience) {
        std::this_thread::sleep_for(kStep);
    }
    EXPECT_EQ(AskSilent(), 1u);
    hand.Want(1);
    while (AskSilent() == 1 && ToSeconds(coordinator->Now() - start) < 2 * kPatience) {
    }
    EXPECT_EQ(AskSilent(), 0u);
}

}  // namespace
}  // namespace relume::server
