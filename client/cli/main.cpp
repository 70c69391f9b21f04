// relume: the command line. Each command is a file of its own, listed in commands.cpp.
#include <csignal>

#include "client/cli/commands.h"

int main(int argc, char** argv) {
    std::signal(SIGPIPE, SIG_IGN);
    relume::client::Interrupts interrupts;
    return relume::client::RunCommandLine(argc, argv, &interrupts);
}
