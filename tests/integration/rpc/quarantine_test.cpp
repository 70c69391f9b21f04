// A worker whose answers are not those of others: gets no more leases until it is released.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <string>
#include <vector>

#include "client/lib/client.h"
#include "core/base/error.h"
#include "tests/integration/rpc/farm_fixture.h"

namespace relume::server {
namespace {

using testing::HasSubstr;

class QuarantineTest : public FarmFixture {
  protected:
    QuarantineTest() {
        ServerOptions options;
        options.coordinator.cross_check = 1;
        Restart(options);
    }

    void WaitForWorkers(std::size_t count) {
        EXPECT_TRUE(WaitFor([&] { return client().Workers().size() >= count; }))
            << "workers do not come";
    }
    v1::Worker Find(const std::string& name) {
        for (v1::Worker& worker : client().Workers()) {
            if (worker.name() == name) {
                return worker;
            }
        }
        return {};
    }
    client::Client& client() {
        if (!client_) {
            client_ =
                std::make_unique<client::Client>(client::Endpoint{ToString(server->address()), {}});
        }
        return *client_;
    }

  private:
    std::unique_ptr<client::Client> client_;
};

TEST_F(QuarantineTest, EndsWhenTheWorkerIsReleased) {
    const auto odd = StartWorker({.name = "odd", .machine = "m1", .odd = true});
    const auto one = StartWorker({.name = "one", .machine = "m2"});
    const auto two = StartWorker({.name = "two", .machine = "m3"});
    WaitForWorkers(3);
    EXPECT_EQ(WaitForEnd(MustCreate(Spec()).name()).state(), v1::JOB_STATE_SUCCEEDED);
    EXPECT_THAT(Find("odd").quarantined(), HasSubstr("not that of two others"));
    EXPECT_EQ(Find("one").quarantined() + Find("two").quarantined(), "");

    const int leases = odd->leases();
    EXPECT_EQ(WaitForEnd(MustCreate(Spec()).name()).state(), v1::JOB_STATE_SUCCEEDED);
    EXPECT_EQ(odd->leases(), leases);

    client().Release("odd");
    EXPECT_EQ(Find("odd").quarantined(), "");
    EXPECT_EQ(WaitForEnd(MustCreate(Spec()).name()).state(), v1::JOB_STATE_SUCCEEDED);
    EXPECT_GT(odd->leases(), leases);
}

TEST_F(QuarantineTest, NobodyElseCanBeReleased) {
    const auto one = StartWorker({.name = "one", .machine = "m2"});
    WaitForWorkers(1);
    try {
        client().Release("one");
        FAIL() << "it was not in quarantine";
    } catch (const Error& error) {
        EXPECT_EQ(error.code(), ErrorCode::kNotFound);
        EXPECT_THAT(error.what(), HasSubstr("'one' is in quarantine"));
    }
}

}  // namespace
}  // namespace relume::server
