#include "client/cli/commands.h"

#include <fmt/format.h>
#include <grpc/support/log.h>

#include <cerrno>
#include <cstdio>
#include <vector>

#include "client/cli/exit_codes.h"
#include "core/base/error.h"
#include "core/base/log.h"
#include "proto/codec/protocol.h"

namespace relume::client {

Runner AddRender(CLI::App* app);
Runner AddSubmit(CLI::App* app);
Runner AddWatch(CLI::App* app);
Runner AddFetch(CLI::App* app);
Runner AddCancel(CLI::App* app);
Runner AddPause(CLI::App* app);
Runner AddResume(CLI::App* app);
Runner AddUpdate(CLI::App* app);
Runner AddExtend(CLI::App* app);
Runner AddJobs(CLI::App* app);
Runner AddWorkers(CLI::App* app);
Runner AddRelease(CLI::App* app);
Runner AddFarm(CLI::App* app);
Runner AddDenoise(CLI::App* app);
Runner AddCompare(CLI::App* app);
Runner AddVerify(CLI::App* app);
Runner AddInfo(CLI::App* app);
Runner AddHelp(CLI::App* app);

namespace {

// One line a command, and its prototype above; each is defined in the file of its name.
constexpr Command kCommands[] = {
    {"render", "render a scene on a local farm or a server, and wait for the image", AddRender},
    {"submit", "hand a job to a server", AddSubmit},
    {"watch", "show a job until it is over", AddWatch},
    {"fetch", "get the image of a job", AddFetch},
    {"cancel", "end jobs, with an image of what is there", AddCancel},
    {"pause", "hold jobs until they are resumed", AddPause},
    {"resume", "let paused jobs go on", AddResume},
    {"update", "change the priority of jobs", AddUpdate},
    {"extend", "add samples to a job that has an image", AddExtend},
    {"jobs", "list a server's jobs", AddJobs},
    {"workers", "list a server's workers", AddWorkers},
    {"release", "give workers in quarantine work again", AddRelease},
    {"farm", "run a server and workers on this machine until Ctrl-C", AddFarm},
    {"denoise", "filter an image", AddDenoise},
    {"compare", "measure how far images are from a reference", AddCompare},
    {"verify", "test the error that an image claims against fresh samples", AddVerify},
    {"info", "say what is in a scene or an image", AddInfo},
    {"help", "help on a command, on filters, samplers or exit-codes", AddHelp},
};

// What is wrong with the command line, and where to look.
std::string UsageProblem(const CLI::App& app, const CLI::ParseError& error) {
    const auto parsed = app.get_subcommands();
    const std::string help =
        parsed.empty() ? "relume --help" : "relume " + parsed.front()->get_name() + " --help";
    std::string problem = error.what();
    // An unknown option may be why another one seems to be missing.
    const auto extras = app.remaining(true);
    for (const auto& extra : extras) {
        if (extra.size() > 1 && extra[0] == '-') {
            return fmt::format("unknown option '{}'; see `{}`", extra, help);
        }
    }
    if (!extras.empty()) {
        problem = parsed.empty() ? fmt::format("no command '{}'", extras.front())
                                 : fmt::format("unexpected argument '{}'", extras.front());
    } else if (parsed.empty()) {
        problem = "which command?";
    }
    return fmt::format("{}; see `{}`", problem.substr(0, problem.find('\n')), help);
}

// One line, whatever the message.
void PrintError(std::string message) {
    for (auto& c : message) {
        c = c == '\n' ? ' ' : c;
    }
    std::fflush(stdout);
    fmt::print(stderr, "relume: {}\n", message);
}

// What went to stdout has arrived, or else it is not there.
int Finish(int exit_code) {
    if (std::fflush(stdout) == 0 && std::ferror(stdout) == 0) {
        return exit_code;
    }
    if (errno != EPIPE) {
        PrintError("standard output: can't be written; free some space or choose another file");
    }
    return kExitOutput;
}

}  // namespace

std::span<const Command> Commands() { return kCommands; }

int RunCommandLine(int argc, char** argv, Interrupts* interrupts) {
    CLI::App app{
        "Renders scenes to images of known accuracy, on one machine or many.\n"
        "`relume COMMAND --help` tells a command's options.",
        "relume"};
    app.set_version_flag("--version", kBuild);
    app.require_subcommand(0, 1);
    std::vector<Runner> runners;
    for (const auto& command : kCommands) {
        runners.push_back(command.add(app.add_subcommand(command.name, command.summary)));
    }
    try {
        app.parse(argc, argv);
        for (std::size_t i = 0; i < runners.size(); ++i) {
            if (app.got_subcommand(kCommands[i].name)) {
                InitLogging("relume", "warn", LogFormat::kText);
                // What gRPC has to say is for its developers; what goes wrong is said by us.
                gpr_set_log_function([](gpr_log_func_args*) {});
                return Finish(runners[i](interrupts));
            }
        }
        throw CLI::RequiredError("COMMAND");
    } catch (const CLI::ParseError& error) {
        if (error.get_exit_code() == 0) {  // --help, --version
            app.exit(error);
            return Finish(kExitDone);
        }
        PrintError(UsageProblem(app, error));
        return kExitUsage;
    } catch (const std::exception& error) {
        PrintError(error.what());
        const int signal = interrupts->signal();
        return signal != 0 ? kExitSignal + signal : ExitCodeOf(error);
    }
}

}  // namespace relume::client
