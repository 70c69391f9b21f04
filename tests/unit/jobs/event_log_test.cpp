#include "server/jobs/event_log.h"

#include <gtest/gtest.h>

namespace relume::jobs {
namespace {

TEST(EventLog, NumbersFromOneAndKeepsTheNewest) {
    EventLog log(3);
    EXPECT_FALSE(log.Find(0).has_value());
    JobInfo info;
    for (std::uint64_t i = 1; i <= 5; ++i) {
        info.samples_done = 10 * i;
        log.Append(info);
    }
    EXPECT_EQ(log.last(), 5u);
    EXPECT_EQ(log.Find(0)->number, 3u);
    EXPECT_EQ(log.Find(2)->number, 3u);
    EXPECT_EQ(log.Find(4)->number, 4u);
    EXPECT_EQ(log.Find(4)->job->samples_done, 40u);
    EXPECT_FALSE(log.Find(6).has_value());
}

TEST(EventLog, EventsStayAsTheyWere) {
    EventLog log(8);
    JobInfo info;
    info.message = "early";
    log.Append(info);
    info.message = "late";
    EXPECT_EQ(log.Find(1)->job->message, "early");
}

}  // namespace
}  // namespace relume::jobs
