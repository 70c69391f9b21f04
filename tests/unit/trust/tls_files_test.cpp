#include "core/trust/tls_files.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <sys/stat.h>

#include "core/base/error.h"
#include "tests/support/test_certs.h"

namespace relume {
namespace {

using testing::AllOf;
using testing::HasSubstr;

class TlsFilesTest : public testing::Test {
  protected:
    static void SetUpTestSuite() { certs = new TestCerts; }
    static void TearDownTestSuite() {
        delete certs;
        certs = nullptr;
    }

    static std::string Refusal(const TlsFiles& files, TlsPems (*load)(const TlsFiles&)) {
        try {
            load(files);
        } catch (const Error& error) {
            EXPECT_EQ(error.code(), ErrorCode::kInvalidArgument);
            return error.what();
        }
        return "none";
    }

    static TestCerts* certs;
};
TestCerts* TlsFilesTest::certs = nullptr;

TEST_F(TlsFilesTest, WhatDeployMakesIsGood) {
    for (const char* role : {"worker", "client", "admin"}) {
        EXPECT_EQ(LoadClientTls(certs->Files(role)).key, certs->Pems(role).key);
    }
    EXPECT_TRUE(LoadServerTls(certs->Files("server")).enabled());
    struct stat status {};
    ASSERT_EQ(stat(certs->Path("server", "key.pem").c_str(), &status), 0);
    EXPECT_EQ(status.st_mode & 0777, 0600u);
    ASSERT_EQ(stat(certs->Path("ca", "key.pem").c_str(), &status), 0);
    EXPECT_EQ(status.st_mode & 0777, 0600u);
}

TEST_F(TlsFilesTest, NothingIsNoTlsAndHalvesAreRefused) {
    const TlsFiles server = certs->Files("server"), client = certs->Files("client");
    EXPECT_FALSE(LoadServerTls({}).enabled());
    EXPECT_FALSE(LoadClientTls({}).enabled());
    EXPECT_TRUE(LoadServerTls({server.cert, server.key, ""}).enabled());
    EXPECT_TRUE(LoadClientTls({"", "", client.ca}).enabled());
    EXPECT_THAT(Refusal({server.cert, "", server.ca}, LoadServerTls), HasSubstr("--tls-key"));
    EXPECT_THAT(Refusal({"", server.key, ""}, LoadServerTls), HasSubstr("--tls-cert"));
    EXPECT_THAT(Refusal({"", "", server.ca}, LoadServerTls), HasSubstr("its own certificate"));
    EXPECT_THAT(Refusal({client.cert, client.key, ""}, LoadClientTls), HasSubstr("--tls-ca"));
}

TEST_F(TlsFilesTest, AFileThatWillNotDoIsNamedWithItsOption) {
    const TlsFiles good = certs->Files("client");
    TlsFiles files = good;
    files.cert = certs->Path("none", "cert.pem");
    EXPECT_THAT(Refusal(files, LoadClientTls), AllOf(HasSubstr("--tls-cert " + files.cert)));
    files = good;
    files.cert = good.key;
    EXPECT_THAT(Refusal(files, LoadClientTls),
                AllOf(HasSubstr("--tls-cert " + files.cert), HasSubstr("no certificate")));
    files = good;
    files.key = good.cert;
    EXPECT_THAT(Refusal(files, LoadClientTls),
                AllOf(HasSubstr("--tls-key " + files.key), HasSubstr("no private key")));
    files = good;
    files.key = certs->Path("worker", "key.pem");
    EXPECT_THAT(Refusal(files, LoadClientTls),
                AllOf(HasSubstr(files.key), HasSubstr("is not the key of")));
    files = good;
    files.ca = good.key;
    EXPECT_THAT(Refusal(files, LoadClientTls), HasSubstr("--tls-ca " + files.ca));
}

TEST_F(TlsFilesTest, AKeyThatEverybodyReadsIsRefused) {
    const TlsFiles files = certs->Files("admin");
    ASSERT_EQ(chmod(files.key.c_str(), 0644), 0);
    EXPECT_THAT(Refusal(files, LoadClientTls), HasSubstr("chmod 600"));
    ASSERT_EQ(chmod(files.key.c_str(), 0640), 0);
    EXPECT_EQ(Refusal(files, LoadClientTls), "none");
    ASSERT_EQ(chmod(files.key.c_str(), 0600), 0);
}

TEST_F(TlsFilesTest, AnExpiredCertificateIsRefusedWithItsDate) {
    certs->MakeExpired("worker", "old");
    EXPECT_THAT(Refusal(certs->Files("old"), LoadClientTls),
                AllOf(HasSubstr("has expired on "), HasSubstr(" GMT"), HasSubstr("deploy/certs")));
    EXPECT_THAT(Refusal({"", "", certs->Path("old", "cert.pem")}, LoadClientTls),
                HasSubstr("--tls-ca"));
}

}  // namespace
}  // namespace relume
