#pragma once

#include <CLI/CLI.hpp>
#include <functional>
#include <span>

#include "client/cli/interrupts.h"

namespace relume::client {

// Runs a command whose options are read; answers with the exit code, or throws Error.
using Runner = std::function<int(Interrupts* interrupts)>;

struct Command {
    const char* name;
    const char* summary;
    // Adds the command's options to `app`, and makes what runs it afterwards.
    Runner (*add)(CLI::App* app);
};

std::span<const Command> Commands();

// Reads the command line and runs the command. What goes wrong is one line on stderr.
int RunCommandLine(int argc, char** argv, Interrupts* interrupts);

}  // namespace relume::client
