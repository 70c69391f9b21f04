// A worker lives longer than its certificate.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <chrono>
#include <csignal>
#include <filesystem>
#include <future>
#include <thread>

#include "client/lib/client.h"
#include "core/base/error.h"
#include "server/rpc/server.h"
#include "tests/support/test_certs.h"
#include "worker/loop/worker.h"

namespace relume::server {
namespace {

using testing::ElementsAre;

class RenewedWorkerTest : public testing::Test {
  protected:
    static void SetUpTestSuite() { std::signal(SIGPIPE, SIG_IGN); }

    // A server of that CA, at the port of the one before.
    void Serve(const TestCerts& certs) {
        const int port = server ? server->address().port : 0;
        server.reset();
        ServerOptions options;
        options.listen.host = "127.0.0.1";
        options.listen.port = port;
        options.tls = certs.Pems("server");
        options.coordinator.data = folder.path() / "data";
        server = std::make_unique<Server>(options);
    }
    void Give(const TestCerts& certs) {
        for (const char* file : {"cert.pem", "key.pem", "ca.pem"}) {
            std::filesystem::copy_file(certs.Path("worker", file), folder.path() / file,
                                       std::filesystem::copy_options::overwrite_existing);
        }
    }
    void Work(const std::string& host = "127.0.0.1") {
        worker::WorkerOptions options;
        options.server = host + ":" + std::to_string(server->address().port);
        options.name = "long-lived";
        options.isa = "avx2";
        options.cache_folder = folder.path() / "cache";
        options.tls_files = {folder.path() / "cert.pem", folder.path() / "key.pem",
                             folder.path() / "ca.pem"};
        options.tls = LoadClientTls(options.tls_files);
        options.tls_refresh_seconds = 1;
        worker = std::make_unique<worker::Worker>(
            options,
            [](const FileSource&, const SceneManifest&,
               const RenderSettings&) -> std::shared_ptr<const worker::LoadedScene> {
                ThrowInvalidArgument("there are no jobs here");
            });
        running = std::async(std::launch::async, [this] { worker->Run(); });
    }
    // Who works, as soon as somebody does, or after half a minute.
    std::vector<std::string> Workers(const TestCerts& certs) {
        client::Client client({ToString(server->address()), certs.Pems("client")});
        std::vector<std::string> names;
        for (int i = 0; i < 300 && names.empty(); ++i) {
            for (const v1::Worker& listed : client.Workers()) {
                names.push_back(listed.name());
            }
            std::this_thread::sleep_for(std::chrono::milliseconds(100));
        }
        return names;
    }
    ~RenewedWorkerTest() override {
        if (worker) {
            worker->Stop();
            if (running.valid()) {
                running.wait();
            }
        }
    }

    TemporaryFolder folder;
    std::unique_ptr<Server> server;
    std::unique_ptr<worker::Worker> worker;
    std::future<void> running;
};

TEST_F(RenewedWorkerTest, ConnectsWithTheNewCertificateOnceItsStreamIsCut) {
    const TestCerts old, renewed;
    Give(old);
    Serve(old);
    Work();
    EXPECT_THAT(Workers(old), ElementsAre("long-lived"));
    Give(renewed);
    Serve(renewed);  // believes the new one alone, as the worker does that server
    EXPECT_THAT(Workers(renewed), ElementsAre("long-lived"));
}

TEST_F(RenewedWorkerTest, ASecondRenewalCountsWhereTheFirstWasNoPair) {
    const TestCerts old, renewed;
    Give(old);
    Serve(old);
    Work();
    EXPECT_THAT(Workers(old), ElementsAre("long-lived"));
    // A key without its certificate: the worker stays as it was.
    std::filesystem::copy_file(renewed.Path("worker", "key.pem"), folder.path() / "key.pem",
                               std::filesystem::copy_options::overwrite_existing);
    Serve(old);
    EXPECT_THAT(Workers(old), ElementsAre("long-lived"));
    Give(renewed);
    Serve(renewed);
    EXPECT_THAT(Workers(renewed), ElementsAre("long-lived"));
}

TEST_F(RenewedWorkerTest, TheServersNameIsCheckedAsEver) {
    const TestCerts certs;
    Give(certs);
    ServerOptions options;
    options.listen.host = "127.0.0.2";  // not among the certificate's names
    options.listen.port = 0;
    options.tls = certs.Pems("server");
    options.coordinator.data = folder.path() / "data";
    server = std::make_unique<Server>(options);
    Work("127.0.0.2");
    try {
        running.get();
        ADD_FAILURE() << "it was let in";
    } catch (const Error& error) {
        EXPECT_EQ(error.code(), ErrorCode::kUnauthenticated);
        EXPECT_THAT(error.what(), testing::HasSubstr("not for '127.0.0.2'"));
    }
}

}  // namespace
}  // namespace relume::server
