#include "client/lib/job_names.h"

#include <gtest/gtest.h>

#include <regex>
#include <set>

namespace relume::client {
namespace {

TEST(JobName, TakesBothForms) {
    EXPECT_EQ(JobName("7f3a"), "jobs/7f3a");
    EXPECT_EQ(JobName("jobs/7f3a"), "jobs/7f3a");
}

TEST(JobState, IsOverExactlyInTheEndStates) {
    const std::set<v1::JobState> over{v1::JOB_STATE_SUCCEEDED, v1::JOB_STATE_FAILED,
                                      v1::JOB_STATE_CANCELLED};
    std::set<std::string> names;
    for (int i = v1::JobState_MIN; i <= v1::JobState_MAX; ++i) {
        const auto state = static_cast<v1::JobState>(i);
        EXPECT_EQ(IsOver(state), over.count(state) != 0) << StateName(state);
        EXPECT_TRUE(names.insert(StateName(state)).second) << StateName(state);
    }
}

TEST(StopReason, EachHasAName) {
    std::set<std::string> names;
    for (int i = v1::StopReason_MIN; i <= v1::StopReason_MAX; ++i) {
        const std::string name = StopReasonName(static_cast<v1::StopReason>(i));
        EXPECT_TRUE(names.insert(name).second) << name;
    }
}

TEST(RequestId, IsARandomUuidOfVersion4) {
    const std::regex uuid("[0-9a-f]{8}-[0-9a-f]{4}-4[0-9a-f]{3}-[89ab][0-9a-f]{3}-[0-9a-f]{12}");
    std::set<std::string> ids;
    for (int i = 0; i < 1000; ++i) {
        const std::string id = MakeRequestId();
        EXPECT_TRUE(std::regex_match(id, uuid)) << id;
        EXPECT_TRUE(ids.insert(id).second) << id;
    }
}

}  // namespace
}  // namespace relume::client
