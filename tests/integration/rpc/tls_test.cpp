// Who is let in: a server with TLS, with certificates of roles, and with a join token.
#include <fmt/format.h>
#include <gmock/gmock.h>
#include <google/protobuf/descriptor.h>
#include <grpcpp/create_channel.h>
#include <grpcpp/generic/generic_stub.h>
#include <netinet/in.h>
#include <sys/socket.h>
#include <unistd.h>

#include <atomic>
#include <chrono>
#include <csignal>
#include <filesystem>
#include <functional>
#include <optional>
#include <set>
#include <thread>

#include "client/lib/client.h"
#include "core/base/error.h"
#include "core/trust/join_token.h"
#include "core/trust/tls_probe.h"
#include "proto/channel/credentials.h"
#include "relume/v1/blobs.grpc.pb.h"
#include "relume/v1/jobs.grpc.pb.h"
#include "server/rpc/access.h"
#include "server/rpc/server.h"
#include "tests/integration/rpc/fake_worker.h"
#include "tests/support/test_certs.h"

namespace relume::server {
namespace {

using testing::AllOf;
using testing::HasSubstr;

const std::string kToken = "0123456789abcdef";

// A port of 127.0.0.1 at which every connection is closed as soon as it is there, as by a proxy
// whose server is down.
class ClosedDoor {
  public:
    explicit ClosedDoor(int port = 0) : listener_(socket(AF_INET, SOCK_STREAM | SOCK_CLOEXEC, 0)) {
        const int yes = 1;
        setsockopt(listener_, SOL_SOCKET, SO_REUSEADDR, &yes, sizeof yes);
        sockaddr_in at{};
        at.sin_family = AF_INET;
        at.sin_port = htons(static_cast<std::uint16_t>(port));
        at.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
        socklen_t size = sizeof at;
        if (bind(listener_, reinterpret_cast<sockaddr*>(&at), size) != 0 ||
            listen(listener_, 16) != 0 ||
            getsockname(listener_, reinterpret_cast<sockaddr*>(&at), &size) != 0) {
            ADD_FAILURE() << "no port can be listened at";
        }
        port_ = ntohs(at.sin_port);
        thread_ = std::thread([this] {
            for (int fd; (fd = accept(listener_, nullptr, nullptr)) >= 0;) {
                ++seen_;
                close(fd);
            }
        });
    }
    ~ClosedDoor() {
        shutdown(listener_, SHUT_RDWR);
        thread_.join();
        close(listener_);
    }
    ClosedDoor(const ClosedDoor&) = delete;
    ClosedDoor& operator=(const ClosedDoor&) = delete;

    int port() const { return port_; }
    int seen() const { return seen_; }  // connections so far

  private:
    int listener_, port_ = 0;
    std::atomic<int> seen_ = 0;
    std::thread thread_;
};

class TlsTest : public testing::Test {
  protected:
    static void SetUpTestSuite() {
        std::signal(SIGPIPE, SIG_IGN);
        certs = new TestCerts;
        foreign = new TestCerts;
        certs->MakeExpired("client", "old-client");
        certs->MakeExpired("server", "old-server");
    }
    static void TearDownTestSuite() {
        delete certs;
        delete foreign;
        certs = foreign = nullptr;
    }

    void Start(const TlsPems& tls, const std::string& token = "",
               const std::string& host = "127.0.0.1", int port = 0) {
        ServerOptions options;
        options.listen.host = host;
        options.listen.port = port;
        options.tls = tls;
        options.tls_files = files;
        options.tls_refresh_seconds = 1;
        options.join_token = token;
        options.coordinator.data = folder.path();
        server = std::make_unique<Server>(options);
        address = ToString(server->address());
    }

    // An empty message to a method, by its name; "" as the error of one that is not answered.
    grpc::Status Call(const TlsPems& pems, const std::string& method,
                      const std::string& token = "") const {
        const auto channel = grpc::CreateChannel(address, channel::MakeCredentials(pems));
        grpc::GenericStub stub(channel);
        grpc::ClientContext context;
        context.set_deadline(std::chrono::system_clock::now() + std::chrono::seconds(10));
        if (!token.empty()) {
            context.AddMetadata(kJoinTokenKey, token);
        }
        grpc::CompletionQueue queue;
        const auto next = [&] {
            void* tag = nullptr;
            bool ok = false;
            EXPECT_TRUE(queue.Next(&tag, &ok));
            return ok;
        };
        const auto stream = stub.PrepareCall(&context, method, &queue);
        stream->StartCall(nullptr);
        next();
        grpc::Slice slice("");
        stream->WriteLast(grpc::ByteBuffer(&slice, 1), grpc::WriteOptions(), nullptr);
        next();
        grpc::ByteBuffer response;
        do {
            stream->Read(&response, nullptr);
        } while (next());
        grpc::Status status;
        stream->Finish(&status, nullptr);
        next();
        return status;
    }
    std::string Explain(const TlsPems& pems) const {
        const grpc::Status status = Call(pems, "/relume.v1.JobService/ListJobs");
        EXPECT_EQ(status.error_code(), grpc::StatusCode::UNAVAILABLE) << status.error_message();
        const Error error = channel::ExplainStatus(status, address, pems);
        EXPECT_EQ(error.code(), ErrorCode::kUnauthenticated) << error.what();
        EXPECT_THAT(error.what(), HasSubstr(address));
        return error.what();
    }

    static TestCerts *certs, *foreign;
    TlsFiles files;  // of the next server, if it is to look at them again
    TemporaryFolder folder;
    std::unique_ptr<Server> server;
    std::string address;
};
TestCerts *TlsTest::certs = nullptr, *TlsTest::foreign = nullptr;

TEST(RoleOfUri, IsTheLastPartUnderRelume) {
    EXPECT_EQ(RoleOfUri("spiffe://farm/relume/worker"), Role::kWorker);
    EXPECT_EQ(RoleOfUri("spiffe://studio.example/relume/client"), Role::kClient);
    EXPECT_EQ(RoleOfUri("spiffe://farm/relume/admin"), Role::kAdmin);
    for (const char* uri :
         {"", "relume:worker", "spiffe://", "spiffe:///relume/admin", "spiffe://farm/admin",
          "spiffe://farm/relume/", "spiffe://farm/relume/admins", "spiffe://farm/relume/admin/",
          "spiffe://farm/x/relume/admin", "https://farm/relume/admin",
          "spiffe://farm/relume/Admin"}) {
        EXPECT_EQ(RoleOfUri(uri), std::nullopt) << uri;
    }
}

TEST_F(TlsTest, EveryCallIsForItsRolesAlone) {
    Start(certs->Pems("server"));
    const auto* pool = google::protobuf::DescriptorPool::generated_pool();
    const std::set<std::string> of_workers = {"/relume.v1.WorkerService/Work",
                                              "/relume.v1.BlobService/ReadBlob"};
    const std::set<std::string> not_of_clients = {"/relume.v1.WorkerService/Work",
                                                  "/relume.v1.JobService/ReleaseWorker"};
    int seen = 0;
    for (const char* name : {"JobService", "BlobService", "WorkerService"}) {
        const auto* service = pool->FindServiceByName(std::string("relume.v1.") + name);
        ASSERT_NE(service, nullptr);
        for (int i = 0; i < service->method_count(); ++i) {
            const std::string method =
                "/" + service->full_name() + "/" + service->method(i)->name();
            const auto refused = [&](const char* role) {
                const grpc::Status status = Call(certs->Pems(role), method);
                EXPECT_NE(status.error_code(), grpc::StatusCode::UNAVAILABLE)
                    << status.error_message();
                return status.error_code() == grpc::StatusCode::PERMISSION_DENIED;
            };
            EXPECT_FALSE(refused("admin")) << method;
            EXPECT_EQ(refused("worker"), of_workers.count(method) == 0) << method;
            EXPECT_EQ(refused("client"), not_of_clients.count(method) != 0) << method;
            ++seen;
        }
    }
    EXPECT_GE(seen, 11);
}

TEST_F(TlsTest, ARefusalNamesTheCertificateAndTheRoleThatIsNeeded) {
    Start(certs->Pems("server"));
    const grpc::Status status = Call(certs->Pems("client"), "/relume.v1.WorkerService/Work");
    EXPECT_EQ(status.error_code(), grpc::StatusCode::PERMISSION_DENIED);
    EXPECT_THAT(status.error_message(),
                AllOf(HasSubstr("the certificate 'client' is a client's"), HasSubstr("for workers"),
                      HasSubstr("spiffe://DOMAIN/relume/worker")));
}

TEST_F(TlsTest, WhoHasNoGoodCertificateIsRefusedAtTheHandshakeAndToldWhy) {
    Start(certs->Pems("server"));
    EXPECT_TRUE(Call(certs->Pems("client"), "/relume.v1.JobService/ListJobs").ok());
    EXPECT_EQ(ProbeTls(address, certs->Pems("client")), "");

    EXPECT_THAT(Explain({}), HasSubstr("speaks TLS; give the CA"));
    TlsPems pems = certs->Pems("client");
    EXPECT_THAT(Explain({"", "", pems.ca}), HasSubstr("asks for a certificate"));
    EXPECT_THAT(Explain(foreign->Pems("client")),
                HasSubstr("server's certificate is not believed"));
    pems = foreign->Pems("client");
    pems.ca = certs->Pems("client").ca;
    EXPECT_THAT(Explain(pems), HasSubstr("refuses our certificate: it is of another CA"));
    EXPECT_THAT(Explain(certs->Pems("old-client")),
                HasSubstr("refuses our certificate: it is not valid at this time"));
    EXPECT_THAT(Explain(certs->Pems("server")), HasSubstr("not made for clients"));
}

TEST_F(TlsTest, AServerThatCantBeBelievedIsRefusedAndToldWhy) {
    Start(certs->Pems("old-server"));
    EXPECT_THAT(Explain(certs->Pems("client")),
                HasSubstr("the server's certificate is not valid at this time"));
    server.reset();
    Start(certs->Pems("client"));  // made for who calls, not for servers
    EXPECT_THAT(Explain(certs->Pems("client")), HasSubstr("is not believed"));
    server.reset();
    Start(certs->Pems("server"), "", "127.0.0.2");  // not among its names
    EXPECT_THAT(Explain(certs->Pems("client")),
                AllOf(HasSubstr("not for '127.0.0.2'"), HasSubstr("--name 127.0.0.2")));
    server.reset();
    Start({});
    EXPECT_THAT(Explain(certs->Pems("client")), HasSubstr("does not speak TLS"));
    EXPECT_EQ(ProbeTls(address, {}), "");
}

TEST_F(TlsTest, RenewedFilesCountForNewConnections) {
    const TemporaryFolder live;
    const auto renew = [&](const TestCerts& from) {
        for (const char* file : {"cert.pem", "key.pem", "ca.pem"}) {
            std::filesystem::copy_file(from.Path("server", file), live.path() / file,
                                       std::filesystem::copy_options::overwrite_existing);
        }
    };
    renew(*certs);
    files = {live.path() / "cert.pem", live.path() / "key.pem", live.path() / "ca.pem"};
    Start(certs->Pems("server"));
    const std::string list = "/relume.v1.JobService/ListJobs";
    EXPECT_TRUE(Call(certs->Pems("client"), list).ok());
    EXPECT_EQ(Call(certs->Pems("worker"), list).error_code(), grpc::StatusCode::PERMISSION_DENIED);
    EXPECT_EQ(Call(foreign->Pems("client"), list).error_code(), grpc::StatusCode::UNAVAILABLE);
    EXPECT_EQ(Call({"", "", certs->Pems("client").ca}, list).error_code(),
              grpc::StatusCode::UNAVAILABLE);
    renew(*foreign);
    bool renewed = false;
    for (int i = 0; i < 300 && !renewed; ++i) {
        std::this_thread::sleep_for(std::chrono::milliseconds(100));
        renewed = Call(foreign->Pems("client"), list).ok();
    }
    EXPECT_TRUE(renewed);
    EXPECT_EQ(Call(certs->Pems("client"), list).error_code(), grpc::StatusCode::UNAVAILABLE);
}

TEST_F(TlsTest, AProxyWithoutAServerSaysNothingOfTls) {
    const ClosedDoor door;
    const std::string there = fmt::format("127.0.0.1:{}", door.port());
    EXPECT_EQ(ProbeTls(there, certs->Pems("client")), "");
    EXPECT_EQ(ProbeTls(there, {}), "");
    EXPECT_EQ(door.seen(), 2);
}

TEST_F(TlsTest, AClientFindsTheServerAgainThatWasDown) {
    auto door = std::make_unique<ClosedDoor>();
    const int port = door->port();
    const auto turn = [&](bool down) {
        if (down) {
            server.reset();
            door = std::make_unique<ClosedDoor>(port);
        } else {
            door.reset();
            Start(certs->Pems("server"), "", "127.0.0.1", port);
        }
    };
    turn(false);
    client::Client client({address, certs->Pems("client")});
    EXPECT_TRUE(client.List(1).empty());
    turn(true);
    std::thread patient([&] {
        try {
            client.Get("none");
            ADD_FAILURE() << "there is no such job";
        } catch (const Error& error) {
            EXPECT_EQ(error.code(), ErrorCode::kNotFound) << error.what();
        }
    });
    const auto give_up = std::chrono::steady_clock::now() + std::chrono::seconds(60);
    while (door->seen() < 3 && std::chrono::steady_clock::now() < give_up) {
        std::this_thread::yield();
    }
    EXPECT_GE(door->seen(), 3);
    turn(false);
    patient.join();
}

TEST_F(TlsTest, WithoutACaEverybodyIsLetInEncrypted) {
    TlsPems pems = certs->Pems("server");
    const std::string ca = std::exchange(pems.ca, "");
    Start(pems);
    EXPECT_TRUE(Call({"", "", ca}, "/relume.v1.JobService/ListJobs").ok());
    EXPECT_EQ(ProbeTls(address, {"", "", ca}), "");
    EXPECT_THAT(Explain({}), HasSubstr("speaks TLS"));
}

TEST_F(TlsTest, AWorkerNeedsTheJoinToken) {
    const std::string work = "/relume.v1.WorkerService/Work";
    for (const bool tls : {false, true}) {
        Start(tls ? certs->Pems("server") : TlsPems(), kToken);
        const TlsPems worker = tls ? certs->Pems("worker") : TlsPems();
        const TlsPems client = tls ? certs->Pems("client") : TlsPems();
        const grpc::Status without = Call(worker, work);
        EXPECT_EQ(without.error_code(), grpc::StatusCode::UNAUTHENTICATED);
        EXPECT_THAT(without.error_message(), HasSubstr("--join-token"));
        const grpc::Status wrong = Call(worker, work, "0123456789abcdeF");
        EXPECT_EQ(wrong.error_code(), grpc::StatusCode::UNAUTHENTICATED);
        EXPECT_THAT(wrong.error_message(), HasSubstr("is not this server's"));
        // In, and sent away only because it does not say Hello.
        EXPECT_EQ(Call(worker, work, kToken).error_code(), grpc::StatusCode::INVALID_ARGUMENT);
        EXPECT_TRUE(Call(client, "/relume.v1.JobService/ListJobs").ok());
        if (tls) {  // a token is no certificate
            EXPECT_EQ(Call(client, work, kToken).error_code(), grpc::StatusCode::PERMISSION_DENIED);
        }
        server.reset();
    }
}

}  // namespace
}  // namespace relume::server
