// relume help: of a command, or of a topic.
#include <fmt/format.h>

#include <cstdio>
#include <memory>
#include <string>

#include "client/cli/commands.h"
#include "client/cli/exit_codes.h"
#include "client/cli/replace_process.h"
#include "core/base/error.h"

namespace relume::client {
namespace {

// Of `app` itself: App::help goes on to the subcommand that was parsed, which is this one.
std::string HelpOf(const CLI::App& app, const std::string& usage) {
    return app.get_formatter()->make_help(&app, usage, CLI::AppFormatMode::Normal);
}

void PrintCommandHelp(const CLI::App& app, const std::string& name) {
    for (const auto& command : Commands()) {
        if (name == command.name) {
            fmt::print("{}", HelpOf(*app.get_subcommand(name), "relume " + name));
            return;
        }
    }
    ThrowInvalidArgument(fmt::format(
        "no help on '{}'; there is on filters, samplers, exit-codes and every command", name));
}

}  // namespace

Runner AddHelp(CLI::App* app) {
    const auto topic = std::make_shared<std::string>();
    app->add_option("TOPIC", *topic, "a command, filters, samplers or exit-codes")->type_name("");
    return [topic, app](Interrupts*) -> int {
        CLI::App* const top = app->get_parent();
        if (topic->empty()) {
            fmt::print("{}", HelpOf(*top, "relume"));
        } else if (*topic == "filters") {
            ReplaceProcess("relume-denoise", {"--describe"});
        } else if (*topic == "samplers") {
            ReplaceProcess("relume-server", {"--describe-samplers"});
        } else if (*topic == "exit-codes") {
            fmt::print("{}", DescribeExitCodes());
        } else {
            PrintCommandHelp(*top, *topic);
        }
        return kExitDone;
    };
}

}  // namespace relume::client
