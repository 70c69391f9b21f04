#include "core/base/signals.h"

#include <fcntl.h>
#include <poll.h>
#include <sys/prctl.h>
#include <sys/signalfd.h>
#include <unistd.h>

#include <csignal>
#include <cstdlib>
#include <utility>

#include "core/base/error.h"

namespace relume {

SignalWatcher::SignalWatcher(std::function<void(int)> on_signal)
    : on_signal_(std::move(on_signal)) {
    sigset_t signals;
    sigemptyset(&signals);
    sigaddset(&signals, SIGINT);
    sigaddset(&signals, SIGTERM);
    pthread_sigmask(SIG_BLOCK, &signals, nullptr);
    const int fd = signalfd(-1, &signals, SFD_CLOEXEC);
    if (fd < 0 || pipe2(stop_pipe_, O_CLOEXEC) != 0) {
        if (fd >= 0) {
            close(fd);
        }
        throw Error(ErrorCode::kInternal, "can't watch for signals: too many open files");
    }
    thread_ = std::thread([this, fd] {
        pollfd watched[2] = {{fd, POLLIN, 0}, {stop_pipe_[0], POLLIN, 0}};
        for (;;) {
            if (poll(watched, 2, -1) < 0) {
                continue;  // EINTR
            }
            if (watched[1].revents != 0) {
                break;
            }
            signalfd_siginfo info;
            if (read(fd, &info, sizeof info) == sizeof info) {
                on_signal_(static_cast<int>(info.ssi_signo));
            }
        }
        close(fd);
    });
}

SignalWatcher::~SignalWatcher() {
    close(stop_pipe_[1]);  // the reading end reports the hang-up
    thread_.join();
    close(stop_pipe_[0]);
}

void EndWithParent(int signal, int parent) {
    prctl(PR_SET_PDEATHSIG, signal);
    if (parent > 1 && getppid() != parent) {
        std::_Exit(1);
    }
}

}  // namespace relume
