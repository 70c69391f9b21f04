#include "client/cli/progress.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "client/lib/job_names.h"

namespace relume::client {
namespace {

constexpr double kWindowSeconds = 8;
constexpr double kShortestSpan = 0.2;  // seconds; a rate over less is noise
constexpr int kBarWidth = 24;

double Share(const v1::Job& job) {
    return job.samples_budget() > 0 ? std::clamp(static_cast<double>(job.samples_done()) /
                                                     static_cast<double>(job.samples_budget()),
                                                 0.0, 1.0)
                                    : 0.0;
}

std::string Details(const v1::Job& job, std::optional<double> rate) {
    std::string text = fmt::format("{:.0f} %", std::floor(100 * Share(job)));
    if (!job.passes().empty()) {
        text += fmt::format(", pass {}", job.passes_size());
    }
    if (rate) {
        text += fmt::format(", {} samples/s", FormatCount(*rate));
    }
    if (job.relmse() > 0) {
        text += fmt::format(", estimated RelMSE {:.3g}", job.relmse());
    }
    if (const auto eta = Eta(job, rate)) {
        text += fmt::format(", {} left", FormatDuration(*eta));
    }
    return text;
}

}  // namespace

std::string FormatDuration(double seconds) {
    const auto s = static_cast<std::int64_t>(std::ceil(std::max(0.0, seconds)));
    if (s < 60) {
        return fmt::format("{} s", s);
    }
    if (s < 3600) {
        return fmt::format("{} min {:02} s", s / 60, s % 60);
    }
    return fmt::format("{} h {:02} min", s / 3600, s % 3600 / 60);
}

std::string FormatCount(double count) {
    const char* const units[] = {"", " k", " M", " G", " T"};
    std::size_t unit = 0;
    while (count >= 999.5 && unit + 1 < std::size(units)) {
        count /= 1000;
        ++unit;
    }
    // Three significant digits.
    const int digits = unit == 0 || count >= 99.95 ? 0 : count >= 9.995 ? 1 : 2;
    return fmt::format("{:.{}f}{}", count, digits, units[unit]);
}

void RateEstimate::Add(double seconds, std::uint64_t samples) {
    if (!points_.empty() && seconds <= points_.back().seconds) {
        return;
    }
    points_.push_back({seconds, samples});
    // One point beyond the window stays: the window is never shorter than said.
    while (points_.size() > 2 && seconds - points_[1].seconds >= kWindowSeconds) {
        points_.pop_front();
    }
}

std::optional<double> RateEstimate::PerSecond() const {
    if (points_.size() < 2 || points_.back().seconds - points_.front().seconds < kShortestSpan) {
        return std::nullopt;
    }
    return static_cast<double>(points_.back().samples - points_.front().samples) /
           (points_.back().seconds - points_.front().seconds);
}

std::optional<double> Eta(const v1::Job& job, std::optional<double> rate) {
    if (job.state() != v1::JOB_STATE_RENDERING || !rate || *rate <= 0 ||
        job.samples_done() > job.samples_budget()) {
        return std::nullopt;
    }
    return static_cast<double>(job.samples_budget() - job.samples_done()) / *rate;
}

std::string FormatProgress(const v1::Job& job, std::optional<double> rate) {
    std::string text = StateName(job.state());
    if (job.state() == v1::JOB_STATE_RENDERING || job.state() == v1::JOB_STATE_FILTERING) {
        text += ": " + Details(job, rate);
    }
    return text;
}

std::string FormatBar(const v1::Job& job, std::optional<double> rate, int columns) {
    std::string bar(kBarWidth, ' ');
    const auto full = static_cast<std::size_t>(Share(job) * kBarWidth);
    std::fill_n(bar.begin(), full, '=');
    if (full < bar.size() && job.state() == v1::JOB_STATE_RENDERING) {
        bar[full] = '>';
    }
    std::string text = fmt::format("[{}] {}", bar, Details(job, rate));
    if (job.state() != v1::JOB_STATE_RENDERING) {
        text += ", " + StateName(job.state());
    }
    return text.substr(0, static_cast<std::size_t>(std::max(0, columns)));
}

}  // namespace relume::client
