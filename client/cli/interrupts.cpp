#include "client/cli/interrupts.h"

#include <cstdio>
#include <cstdlib>
#include <utility>

#include "client/cli/exit_codes.h"
#include "core/base/error.h"

namespace relume::client {

Interrupts::Interrupts() : watcher_([this](int signal) { OnSignal(signal); }) {}

void Interrupts::OnSignal(int signal) {
    const std::lock_guard lock(mutex_);
    if (signal_ != 0 || guard_ == nullptr) {
        std::fputs("\nrelume: interrupted\n", stderr);
        std::_Exit(kExitSignal + signal);
    }
    signal_ = signal;
    guard_->on_signal_();
}

int Interrupts::signal() const {
    const std::lock_guard lock(mutex_);
    return signal_;
}

void Interrupts::Check() const {
    if (signal() != 0) {
        throw Error(ErrorCode::kCancelled, "interrupted");
    }
}

Interrupts::Guard::Guard(Interrupts* interrupts, std::function<void()> on_signal)
    : interrupts_(interrupts), on_signal_(std::move(on_signal)) {
    const std::lock_guard lock(interrupts_->mutex_);
    outer_ = std::exchange(interrupts_->guard_, this);
    if (interrupts_->signal_ != 0) {
        on_signal_();
    }
}

Interrupts::Guard::~Guard() {
    const std::lock_guard lock(interrupts_->mutex_);
    interrupts_->guard_ = outer_;
}

}  // namespace relume::client
