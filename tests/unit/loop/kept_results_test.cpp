#include "worker/loop/kept_results.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <string>
#include <vector>

namespace relume::worker {
namespace {

using testing::ElementsAre;
using testing::IsEmpty;

v1::WorkRequest Result(const std::string& ticket, std::size_t bytes) {
    v1::WorkRequest message;
    message.mutable_result()->set_ticket(ticket);
    message.mutable_result()->set_planes(std::string(bytes, 'x'));
    return message;
}

std::vector<std::string> Tickets(const KeptResults& kept) {
    std::vector<std::string> tickets;
    for (const auto& message : kept.All()) {
        tickets.push_back(message.result().ticket());
    }
    return tickets;
}

TEST(KeptResults, AreKeptUntilTheyAreDropped) {
    KeptResults kept(1000);
    kept.Keep(Result("a", 100));
    kept.Keep(Result("b", 200));
    EXPECT_THAT(Tickets(kept), ElementsAre("a", "b"));
    kept.Drop("a");
    kept.Drop("unknown");
    EXPECT_THAT(Tickets(kept), ElementsAre("b"));
    EXPECT_EQ(kept.bytes(), 200u);
}

TEST(KeptResults, TheSameSamplesAreKeptOnce) {
    KeptResults kept(1000);
    kept.Keep(Result("a", 100));
    kept.Keep(Result("b", 100));
    kept.Keep(Result("a", 150));
    EXPECT_THAT(Tickets(kept), ElementsAre("b", "a"));
    EXPECT_EQ(kept.bytes(), 250u);
}

TEST(KeptResults, TheOldestGoWhenTheyAreTooMany) {
    KeptResults kept(250);
    for (const char* ticket : {"a", "b", "c"}) {
        kept.Keep(Result(ticket, 100));
    }
    EXPECT_THAT(Tickets(kept), ElementsAre("b", "c"));
    kept.Keep(Result("d", 300));
    EXPECT_THAT(Tickets(kept), IsEmpty());
    EXPECT_EQ(kept.bytes(), 0u);
}

}  // namespace
}  // namespace relume::worker
