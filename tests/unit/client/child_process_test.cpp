#include "client/lib/child_process.h"

#include <gtest/gtest.h>

#include <csignal>
#include <cstdlib>

#include "core/base/error.h"

namespace relume::client {
namespace {

constexpr double kLong = 30;  // seconds; no test waits for so long unless it fails

// Waits until the child has ended, that is, until its pipes are closed.
void WaitForEnd(ChildProcess* child) {
    while (child->ReadLine(kLong)) {
    }
    child->Terminate(kLong);
}

TEST(ChildProcess, GivesItsLinesInOrderThenNothing) {
    ChildProcess child("/bin/sh", {"-c", "echo one; echo two"}, false);
    EXPECT_EQ(child.ReadLine(kLong), "one");
    EXPECT_EQ(child.ReadLine(kLong), "two");
    EXPECT_EQ(child.ReadLine(kLong), std::nullopt);
}

TEST(ChildProcess, PassesArgumentsUnchanged) {
    ChildProcess child("/bin/sh", {"-c", "echo \"$1|$2\"", "sh", "a b", "*"}, false);
    EXPECT_EQ(child.ReadLine(kLong), "a b|*");
}

TEST(ChildProcess, IsNotToldHowToReachServers) {
    unsetenv("RELUME_NETWORKS");  // may be set where tests run
    for (const char* name : {"RELUME_TLS_CA", "RELUME_TLS_CERT", "RELUME_TLS_KEY",
                             "RELUME_JOIN_TOKEN", "RELUME_OTHER"}) {
        setenv(name, "x", 1);
    }
    ChildProcess child("/bin/sh", {"-c", "env | grep -c RELUME_; echo $RELUME_OTHER"}, false);
    EXPECT_EQ(child.ReadLine(kLong), "1");
    EXPECT_EQ(child.ReadLine(kLong), "x");
    for (const char* name : {"RELUME_TLS_CA", "RELUME_TLS_CERT", "RELUME_TLS_KEY",
                             "RELUME_JOIN_TOKEN", "RELUME_OTHER"}) {
        unsetenv(name);
    }
}

TEST(ChildProcess, LastWordsTellExitCodeAndLastLineOfStderr) {
    ChildProcess child("/bin/sh", {"-c", "echo first >&2; echo last >&2; exit 7"}, false);
    EXPECT_EQ(child.ReadLine(kLong), std::nullopt);
    while (!child.Ended()) {
    }
    EXPECT_EQ(child.LastWords(), "ended with exit code 7: last");
}

TEST(ChildProcess, LastWordsTellTheSignalThatKilledIt) {
    ChildProcess child("/bin/sh", {"-c", "echo up; exec cat /dev/zero >/dev/null"}, false);
    EXPECT_EQ(child.ReadLine(kLong), "up");
    child.Signal(SIGKILL);
    WaitForEnd(&child);
    EXPECT_EQ(child.LastWords(), "was killed by signal 9");
}

TEST(ChildProcess, TerminateLetsItFinish) {
    ChildProcess child("/bin/sh",
                       {"-c", "trap 'echo bye; exit 0' TERM; echo up; while :; do :; done"}, false);
    EXPECT_EQ(child.ReadLine(kLong), "up");
    child.Terminate(kLong);
    EXPECT_TRUE(child.Ended());
    EXPECT_EQ(child.ReadLine(kLong), "bye");
}

TEST(ChildProcess, TerminateKillsOneThatDoesNotListen) {
    ChildProcess child("/bin/sh", {"-c", "trap '' TERM; echo up; while :; do :; done"}, false);
    EXPECT_EQ(child.ReadLine(kLong), "up");
    child.Terminate(0.05);
    EXPECT_TRUE(child.Ended());
    EXPECT_EQ(child.LastWords(), "was killed by signal 9");
}

TEST(ChildProcess, IsGoneWithItsObject) {
    pid_t pid = 0;
    {
        ChildProcess child("/bin/sh", {"-c", "echo up; exec cat /dev/zero >/dev/null"}, false);
        EXPECT_EQ(child.ReadLine(kLong), "up");
        pid = child.pid();
        EXPECT_EQ(kill(pid, 0), 0);
    }
    EXPECT_NE(kill(pid, 0), 0);
}

TEST(ChildProcess, SaysWhatCanNotBeStarted) {
    try {
        ChildProcess child("/no/such/program", {}, false);
        FAIL() << "started";
    } catch (const Error& error) {
        EXPECT_EQ(error.code(), ErrorCode::kNotFound);
        EXPECT_NE(std::string(error.what()).find("/no/such/program"), std::string::npos);
    }
}

}  // namespace
}  // namespace relume::client
