#include "core/trust/join_token.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <sys/stat.h>

#include <vector>

#include "core/base/error.h"
#include "core/base/files.h"

namespace relume {
namespace {

using testing::HasSubstr;
using testing::Not;

class JoinTokenTest : public testing::Test {
  protected:
    std::string Write(const std::string& bytes, mode_t mode = 0600) {
        const std::string path = folder.path() / "token";
        WriteFileAtomically(path, bytes);
        EXPECT_EQ(chmod(path.c_str(), mode), 0);
        return path;
    }
    std::string Refusal(const std::string& bytes, mode_t mode = 0600) {
        try {
            ReadJoinToken(Write(bytes, mode));
        } catch (const Error& error) {
            EXPECT_EQ(error.code(), ErrorCode::kInvalidArgument);
            return error.what();
        }
        return "none";
    }

    TemporaryFolder folder;
};

TEST_F(JoinTokenTest, IsOneLineWithoutWhatIsAroundIt) {
    EXPECT_EQ(ReadJoinToken(Write(" 0123456789abcdef\r\n")), "0123456789abcdef");
    EXPECT_EQ(ReadJoinToken(Write(std::string(1024, 'x'), 0640)), std::string(1024, 'x'));
}

TEST_F(JoinTokenTest, WhatIsNoSecretIsRefusedAndNotRepeated) {
    for (const std::string& bad : std::vector<std::string>{
             std::string(), std::string("\n \n"), std::string("012345678secret"),
             std::string("0123456789abcdef\n0123456789secret"), std::string("0123456789secret ab"),
             "0123456789secret" + std::string(1, '\0'), "0123456789secret\xc3\xa4",
             "secret" + std::string(1019, 'x')}) {
        const std::string refusal = Refusal(bad);
        EXPECT_THAT(refusal, HasSubstr("openssl rand")) << bad;
        EXPECT_THAT(refusal, Not(HasSubstr("secret"))) << bad;
    }
    EXPECT_THAT(Refusal("0123456789abcdef", 0644), HasSubstr("chmod 600"));
    EXPECT_THROW(ReadJoinToken(folder.path() / "none"), Error);
}

TEST(SameToken, IsTrueForEqualOnesAlone) {
    EXPECT_TRUE(SameToken("0123456789abcdef", "0123456789abcdef"));
    for (const char* other : {"", "0123456789abcdeF", "0123456789abcde", "0123456789abcdef0"}) {
        EXPECT_FALSE(SameToken("0123456789abcdef", other)) << other;
    }
}

}  // namespace
}  // namespace relume
