#include "core/base/resources.h"

#include <gtest/gtest.h>
#include <sched.h>

#include <cstdlib>
#include <fstream>
#include <new>
#include <string>
#include <thread>
#include <vector>

#include "core/base/files.h"

namespace relume {
namespace {

namespace fs = std::filesystem;

class GroupLimitsTest : public testing::Test {
  protected:
    void Write(const std::string& path, const std::string& text) const {
        fs::create_directories((folder.path() / path).parent_path());
        std::ofstream(folder.path() / path) << text;
    }
    GroupLimits Read(const std::string& membership) const {
        Write("membership", membership);
        return ReadGroupLimits(folder.path() / "membership", folder.path() / "groups");
    }
    TemporaryFolder folder;
};

TEST_F(GroupLimitsTest, TheLeastOfAGroupAndThoseAboveHolds) {
    Write("groups/farm/cpu.max", "150000 100000\n");
    Write("groups/farm/memory.max", "max\n");
    Write("groups/farm/job/cpu.max", "max 100000\n");
    Write("groups/farm/job/memory.max", "1073741824\n");
    Write("groups/memory.max", "4294967296\n");
    const GroupLimits limits = Read("0::/farm/job\n");
    EXPECT_EQ(limits.cores, 1.5);
    EXPECT_EQ(limits.memory, std::uint64_t{1} << 30);
}

TEST_F(GroupLimitsTest, AContainersPathMayBeTheOneOutside) {
    Write("groups/cpu.max", "50000 100000\n");
    EXPECT_EQ(Read("0::/system.slice/docker-12ab.scope\n").cores, 0.5);
}

TEST_F(GroupLimitsTest, VersionOneIsReadByItsControllers) {
    Write("groups/cpu,cpuacct/box/cpu.cfs_quota_us", "300000\n");
    Write("groups/cpu,cpuacct/box/cpu.cfs_period_us", "100000\n");
    Write("groups/cpu,cpuacct/cpu.cfs_quota_us", "-1\n");
    Write("groups/cpu,cpuacct/cpu.cfs_period_us", "100000\n");
    Write("groups/memory/box/memory.limit_in_bytes", "536870912\n");
    Write("groups/memory/memory.limit_in_bytes", "9223372036854771712\n");
    const GroupLimits limits = Read("4:cpu,cpuacct:/box\n3:memory:/box\n1:name=systemd:/\n");
    EXPECT_EQ(limits.cores, 3.0);
    EXPECT_EQ(limits.memory, std::uint64_t{512} << 20);
}

TEST_F(GroupLimitsTest, JunkLimitsNothing) {
    Write("groups/cpu.max", "many\n");
    Write("groups/memory.max", "");
    for (const char* membership : {"", "0::/\n", "x\n", "::\n", "0::/../..\n"}) {
        const GroupLimits limits = Read(membership);
        EXPECT_FALSE(limits.cores.has_value()) << membership;
        EXPECT_FALSE(limits.memory.has_value()) << membership;
    }
}

TEST(AvailableResources, FollowsTheAffinity) {
    std::thread([] {  // of this thread alone
        cpu_set_t all, one;
        CPU_ZERO(&all);
        CPU_ZERO(&one);
        ASSERT_EQ(sched_getaffinity(0, sizeof all, &all), 0);
        EXPECT_LE(AvailableResources().cores, CPU_COUNT(&all));
        for (int cpu = 0; cpu < CPU_SETSIZE && CPU_COUNT(&one) == 0; ++cpu) {
            if (CPU_ISSET(cpu, &all)) {
                CPU_SET(cpu, &one);
            }
        }
        ASSERT_EQ(sched_setaffinity(0, sizeof one, &one), 0);
        EXPECT_EQ(AvailableResources().cores, 1);
    })
        .join();
    EXPECT_GT(AvailableResources().memory, std::uint64_t{1} << 20);
}

TEST(LimitDataDeathTest, WhatIsBeyondFailsInsteadOfBeingKilled) {
#if defined(__SANITIZE_ADDRESS__) || defined(__SANITIZE_THREAD__)
    GTEST_SKIP() << "a sanitizer's own data is larger than any limit";
#endif
    testing::FLAGS_gtest_death_test_style = "threadsafe";
    EXPECT_EXIT(
        {
            LimitData(std::uint64_t{256} << 20);
            int code = DataLimit() == std::uint64_t{256} << 20 ? 0 : 1;
            try {
                const std::vector<char> fits(64 << 20);
                const std::vector<char> does_not(std::size_t{512} << 20);
                code = 2;
            } catch (const std::bad_alloc&) {
            }
            std::_Exit(code);
        },
        testing::ExitedWithCode(0), "");
}

}  // namespace
}  // namespace relume
