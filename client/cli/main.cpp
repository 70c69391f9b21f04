// relume: the command line. Each command is a file of its own, listed in commands.cpp.
#include <csignal>

#include "client/cli/commands.h"

int main(int argc, char** argv) {
    // A reader that went away and a file that may not grow are errors of a write, not ends.
    std::signal(SIGPIPE, SIG_IGN);
    std::signal(SIGXFSZ, SIG_IGN);
    relume::client::Interrupts interrupts;
    return relume::client::RunCommandLine(argc, argv, &interrupts);
}
