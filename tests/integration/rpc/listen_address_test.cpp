#include "server/rpc/listen_address.h"

#include <gtest/gtest.h>

#include "core/base/error.h"

namespace relume::server {
namespace {

TEST(ListenAddress, ParsesHostsAndPorts) {
    const ListenAddress a = ParseListenAddress("127.0.0.1:7878");
    EXPECT_EQ(a.host, "127.0.0.1");
    EXPECT_EQ(a.port, 7878);
    EXPECT_EQ(ToString(a), "127.0.0.1:7878");
    EXPECT_EQ(ToString(ParseListenAddress("[::1]:0")), "[::1]:0");
    for (const char* text : {"", "7878", ":7878", "host:", "host:x", "host:70000", "host:-1",
                             "::1:7878", "[]:1", "host:1 "}) {
        EXPECT_THROW(ParseListenAddress(text), Error) << text;
    }
}

TEST(ListenAddress, KnowsWhoCanReachIt) {
    for (const char* text :
         {"127.0.0.1:1", "127.9.9.9:1", "localhost:1", "[::1]:1", "[::ffff:127.0.0.1]:1"}) {
        EXPECT_TRUE(IsLoopback(ParseListenAddress(text))) << text;
    }
    for (const char* text : {"0.0.0.0:1", "10.0.0.1:1", "[::]:1", "[::ffff:10.0.0.1]:1", "farm:1",
                             "127.0.0.1.example:1"}) {
        EXPECT_FALSE(IsLoopback(ParseListenAddress(text))) << text;
    }
}

TEST(ListenAddress, IsOpenToOthersOnlyEncryptedOrIfToldSo) {
    const ListenAddress here{"127.0.0.1", 1}, open{"0.0.0.0", 1};
    EXPECT_NO_THROW(CheckExposure(here, false, false, true));
    EXPECT_NO_THROW(CheckExposure(open, true, false, true));
    EXPECT_NO_THROW(CheckExposure(open, false, true, false));
    EXPECT_THROW(CheckExposure(open, false, false, false), Error);
    EXPECT_THROW(CheckExposure(open, false, true, true), Error);
}

}  // namespace
}  // namespace relume::server
