#include "core/trust/loopback.h"

#include <gtest/gtest.h>

namespace relume {
namespace {

using Parts = std::pair<std::string, std::string>;

TEST(SplitHostPort, GivesThePartsOrNothing) {
    EXPECT_EQ(SplitHostPort("farm:7878"), Parts("farm", "7878"));
    EXPECT_EQ(SplitHostPort("[::1]:1"), Parts("::1", "1"));
    for (const char* text :
         {"", "farm", ":1", "farm:", "::1:1", "[]:1", "unix:///run/x:", "dns:///farm:1"}) {
        EXPECT_EQ(SplitHostPort(text), Parts()) << text;
    }
}

TEST(IsLoopbackHost, KnowsWhatOnlyThisMachineReaches) {
    for (const char* host : {"localhost", "127.0.0.1", "127.9.9.9", "::1", "::ffff:127.0.0.1"}) {
        EXPECT_TRUE(IsLoopbackHost(host)) << host;
    }
    for (const char* host : {"", "farm", "0.0.0.0", "::", "10.0.0.1", "127.0.0.1.example"}) {
        EXPECT_FALSE(IsLoopbackHost(host)) << host;
    }
}

}  // namespace
}  // namespace relume
