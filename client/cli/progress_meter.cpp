#include "client/cli/progress_meter.h"

#include <fmt/format.h>
#include <sys/ioctl.h>
#include <unistd.h>

#include <chrono>
#include <utility>

#include "client/lib/job_names.h"

namespace relume::client {
namespace {

constexpr double kBarInterval = 0.1;  // seconds
constexpr double kLineInterval = 3;

double SteadySeconds() {
    return std::chrono::duration<double>(std::chrono::steady_clock::now().time_since_epoch())
        .count();
}

int Columns(std::FILE* out) {
    winsize size{};
    return ioctl(fileno(out), TIOCGWINSZ, &size) == 0 && size.ws_col > 0 ? size.ws_col : 80;
}

}  // namespace

ProgressStyle ChooseProgressStyle(bool quiet, std::FILE* out) {
    if (quiet) {
        return ProgressStyle::kNone;
    }
    return isatty(fileno(out)) != 0 ? ProgressStyle::kBar : ProgressStyle::kLines;
}

ProgressMeter::ProgressMeter(ProgressStyle style, std::FILE* out, std::function<double()> clock)
    : style_(style), out_(out), clock_(clock ? std::move(clock) : SteadySeconds) {}

bool ProgressMeter::Due() {
    const double interval = style_ == ProgressStyle::kBar ? kBarInterval : kLineInterval;
    return clock_() - drawn_ >= interval;
}

void ProgressMeter::Draw(const std::string& text) {
    drawn_ = clock_();
    if (style_ == ProgressStyle::kBar) {
        fmt::print(out_, "\r\x1b[K{}", text);
        std::fflush(out_);
        bar_ = true;
    } else {
        Print(text);
    }
}

void ProgressMeter::Print(const std::string& text) {
    if (std::exchange(bar_, false)) {
        std::fputs("\r\x1b[K", out_);
    }
    fmt::print(out_, "{}\n", text);
    std::fflush(out_);
}

void ProgressMeter::Announce(const std::string& prefix) {
    const std::lock_guard lock(mutex_);
    prefix_ = prefix;
    rate_ = RateEstimate();
}

void ProgressMeter::Update(const v1::Job& job) {
    const std::lock_guard lock(mutex_);
    rate_.Add(job.render_seconds(), job.samples_done());
    const bool changed = std::exchange(state_, job.state()) != job.state();
    if (style_ == ProgressStyle::kNone || IsOver(job.state()) || (!changed && !Due())) {
        return;
    }
    // The last column stays free: a full line would wrap.
    const int columns = Columns(out_) - 1 - static_cast<int>(prefix_.size());
    Draw(prefix_ + (style_ == ProgressStyle::kBar ? FormatBar(job, rate_.PerSecond(), columns)
                                                  : FormatProgress(job, rate_.PerSecond())));
}

void ProgressMeter::Upload(std::uint64_t done, std::uint64_t due) {
    const std::lock_guard lock(mutex_);
    if (style_ == ProgressStyle::kNone || !Due()) {
        return;
    }
    Draw(fmt::format("uploading: {}B of {}B", FormatCount(static_cast<double>(done)),
                     FormatCount(static_cast<double>(due))));
}

void ProgressMeter::Note(const std::string& text) {
    const std::lock_guard lock(mutex_);
    if (style_ != ProgressStyle::kNone) {
        Print(text);
    }
}

void ProgressMeter::Warn(const std::string& text) {
    const std::lock_guard lock(mutex_);
    Print(text);
}

void ProgressMeter::Clear() {
    const std::lock_guard lock(mutex_);
    if (std::exchange(bar_, false)) {
        std::fputs("\r\x1b[K", out_);
        std::fflush(out_);
    }
}

}  // namespace relume::client
