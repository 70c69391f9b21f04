// The command line as a whole, as far as it works without a server.
#include <gtest/gtest.h>

#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <string>
#include <vector>

#include "client/cli/commands.h"
#include "client/cli/exit_codes.h"
#include "client/cli/table.h"
#include "core/base/files.h"
#include "core/image/exr.h"

namespace relume::client {
namespace {

struct Outcome {
    int exit_code = 0;
    std::string out, err;
};

Outcome RunCommand(std::vector<std::string> arguments) {
    arguments.insert(arguments.begin(), "relume");
    std::vector<char*> argv;
    for (auto& argument : arguments) {
        argv.push_back(argument.data());
    }
    for (const char* name :
         {"RELUME_SERVER", "RELUME_TLS_CA", "RELUME_TLS_CERT", "RELUME_TLS_KEY"}) {
        unsetenv(name);
    }
    static Interrupts interrupts;
    testing::internal::CaptureStdout();
    testing::internal::CaptureStderr();
    Outcome outcome;
    outcome.exit_code = RunCommandLine(static_cast<int>(argv.size()), argv.data(), &interrupts);
    outcome.out = testing::internal::GetCapturedStdout();
    outcome.err = testing::internal::GetCapturedStderr();
    return outcome;
}

void ExpectRefused(const std::vector<std::string>& arguments, int exit_code,
                   const std::string& what) {
    const Outcome outcome = RunCommand(arguments);
    EXPECT_EQ(outcome.exit_code, exit_code) << what;
    EXPECT_EQ(outcome.err.rfind("relume: ", 0), 0u) << outcome.err;
    EXPECT_EQ(outcome.err.find('\n'), outcome.err.size() - 1) << outcome.err;
    EXPECT_NE(outcome.err.find(what), std::string::npos) << outcome.err;
    EXPECT_EQ(outcome.out, "");
}

TEST(CommandLine, RefusesInOneLineThatSaysWhereToLook) {
    ExpectRefused({"render", "s.gltf", "-o", "x.exr", "--foo", "3"}, kExitUsage, "'--foo'");
    ExpectRefused({"render", "--foo"}, kExitUsage, "relume render --help");
    ExpectRefused({"rendr", "s.gltf"}, kExitUsage, "'rendr'");
    ExpectRefused({}, kExitUsage, "relume --help");
    ExpectRefused({"--foo"}, kExitUsage, "relume --help");
    ExpectRefused({"render", "s.gltf"}, kExitUsage, "--output");
    ExpectRefused({"render", "s.gltf", "-o", "x.exr", "--size", "0x0"}, kExitUsage, "1 to 65536");
    ExpectRefused({"render", "s.gltf", "-o", "x.exr", "--tile-size", "7"}, kExitUsage, "8 to 64");
    for (const char* option : {"--spp", "--target", "--time-limit", "--min-spp", "--max-spp"}) {
        for (const char* value : {"0", "-1", "nan", "x"}) {
            ExpectRefused({"render", "s.gltf", "-o", "x.exr", std::string(option) + "=" + value},
                          kExitUsage, std::string(option) + " " + value + ": must be a");
        }
    }
    ExpectRefused({"render", "s.gltf", "-o", "x", "--png", "x"}, kExitUsage, "one file");
    ExpectRefused(
        {"render", "s.gltf", "-o", "x.exr", "--workers", "2", "--server", "localhost:7878"},
        kExitUsage, "--workers");
    ExpectRefused({"verify", "x.exr", "s.gltf", "--spp", "63"}, kExitUsage, "even");
    ExpectRefused({"verify", "x.exr", "s.gltf", "--pixels", "1"}, kExitUsage, "1000000");
    ExpectRefused({"jobs"}, kExitUsage, "RELUME_SERVER");
    ExpectRefused({"jobs", "--server", "localhost"}, kExitUsage, "localhost:7878");
    ExpectRefused({"jobs", "--server", "a:1", "--tls-cert", "c.pem"}, kExitUsage, "--tls-key");
    ExpectRefused({"jobs", "--server", "a:1", "--tls-ca", "no.pem"}, kExitUsage,
                  "--tls-ca no.pem: can't open");
    ExpectRefused({"help", "foo"}, kExitUsage, "exit-codes");
}

TEST(CommandLine, RefusesFilesThatAreNotThere) {
    ExpectRefused({"render", "no.gltf", "-o", "x.exr"}, kExitInput, "no.gltf");
    ExpectRefused({"info", "no.gltf"}, kExitInput, "no.gltf");
    ExpectRefused({"verify", "no.exr", "no.gltf"}, kExitInput, "no.exr");
    ExpectRefused({"compare", "no.exr", "no.exr"}, kExitInput, "no.exr");
    ExpectRefused({"render", "no.gltf", "-o", "no/x.exr"}, kExitOutput, "no/x.exr");
}

TEST(CommandLine, InfoTakesTheWordAfterPngForTheImage) {
    const TemporaryFolder folder;
    const std::string image = (folder.path() / "image.exr").string();
    WriteExr(image, Image(4, 3, {"R", "G", "B", "relmse.Y"}));
    const Outcome outcome = RunCommand({"info", "--png", image, "--json"});
    EXPECT_EQ(outcome.exit_code, kExitDone) << outcome.err;
    EXPECT_NE(outcome.out.find("image.relmse.png"), std::string::npos);
    EXPECT_TRUE(std::filesystem::exists(folder.path() / "image.relmse.png"));
    const std::string scene = (folder.path() / "scene.gltf").string();
    std::ofstream(scene) << "{}";
    ExpectRefused({"info", scene, "--png"}, kExitInput, "scene.gltf: --png");
    ExpectRefused({"info", image, "--png=" + scene}, kExitOutput, "scene.gltf/image.relmse.png");
}

TEST(CommandLine, SaysSoonThatNoServerIsThere) {
    ExpectRefused({"jobs", "--server", "127.0.0.1:1"}, kExitServer, "127.0.0.1:1");
}

TEST(CommandLine, EveryCommandHasHelp) {
    for (const auto& command : Commands()) {
        const Outcome outcome = RunCommand({command.name, "--help"});
        EXPECT_EQ(outcome.exit_code, kExitDone);
        EXPECT_NE(outcome.out.find(command.summary), std::string::npos) << outcome.out;
        EXPECT_EQ(RunCommand({"help", command.name}).out, outcome.out);
    }
    EXPECT_EQ(RunCommand({"help"}).out, RunCommand({"--help"}).out);
}

TEST(CommandLine, EveryCommandAndOptionIsInTheDocument) {
    std::ifstream in(std::string(RELUME_SOURCE_DIR) + "/docs/commands.md");
    const std::string text{std::istreambuf_iterator<char>(in), {}};
    for (const auto& command : Commands()) {
        EXPECT_NE(text.find(std::string("`relume ") + command.name), std::string::npos)
            << command.name;
        CLI::App app;
        command.add(&app);
        for (const auto* option : app.get_options()) {
            for (const auto& name : option->get_lnames()) {
                EXPECT_TRUE(name == "help" || text.find("--" + name) != std::string::npos)
                    << command.name << " --" << name;
            }
        }
    }
}

TEST(ExitCode, FollowsFromTheError) {
    EXPECT_EQ(ExitCodeOf(CommandError(kExitInput, "")), kExitInput);
    EXPECT_EQ(ExitCodeOf(OutputError(ErrorCode::kResourceExhausted, "")), kExitOutput);
    EXPECT_EQ(ExitCodeOf(Error(ErrorCode::kUnavailable, "")), kExitServer);
    EXPECT_EQ(ExitCodeOf(std::runtime_error("")), kExitFailure);
    const auto fail = [](auto error) { return [error] { throw error; }; };
    EXPECT_THROW(WithExitCode(kExitInput, fail(Error(ErrorCode::kNotFound, ""))), CommandError);
    EXPECT_THROW(WithExitCode(kExitInput, fail(OutputError(ErrorCode::kNotFound, ""))),
                 OutputError);
}

TEST(Table, LinesColumnsUp) {
    EXPECT_EQ(FormatTable({{"NAME", "N", "NOTE"}, {"a", "1", ""}, {"long name", "1000", "x"}}),
              "NAME          N  NOTE\n"
              "a             1\n"
              "long name  1000  x\n");
}

}  // namespace
}  // namespace relume::client
