#include "client/cli/progress.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <cmath>
#include <vector>

#include "client/lib/job_names.h"

namespace relume::client {
namespace {

constexpr double kWindowSeconds = 8;
constexpr double kShortestSpan = 0.2;  // seconds; a rate over less is noise
constexpr int kBarWidth = 24;

std::string Details(const v1::Job& job, std::optional<double> rate) {
    std::vector<std::string> parts;
    if (const auto share = ShareDone(job)) {
        parts.push_back(fmt::format("{:.0f} %", std::floor(100 * *share)));
    }
    if (!job.passes().empty()) {
        parts.push_back(fmt::format("pass {}", job.passes_size()));
    }
    if (rate) {
        parts.push_back(FormatCount(*rate) + " samples/s");
    }
    if (const auto error = EstimatedError(job)) {
        parts.push_back(fmt::format("estimated RelMSE {:.3g}", *error));
    }
    if (const std::string eta = FormatEta(job); !eta.empty()) {
        parts.push_back(eta);
    }
    return fmt::format("{}", fmt::join(parts, ", "));
}

// A queued job may have a reason not to be started.
std::string StateAndReason(const v1::Job& job) {
    const bool waits = job.state() == v1::JOB_STATE_QUEUED && !job.message().empty();
    return StateText(job) + (waits ? ", " + job.message() : "");
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

std::optional<double> EstimatedError(const v1::Job& job) {
    // Without a target it is estimated once, and soon out of date.
    if (job.has_image_relmse() && job.spec().has_target()) {
        return job.image_relmse();
    }
    return job.relmse() > 0 ? std::optional(job.relmse()) : std::nullopt;
}

std::string FormatEta(const v1::Job& job) {
    if (!job.has_eta_seconds()) {
        return "";
    }
    const std::string eta = FormatDuration(job.eta_seconds());
    const std::string low = FormatDuration(job.eta_low_seconds());
    const std::string high = FormatDuration(job.eta_high_seconds());
    if (low == high) {
        return eta + " left";
    }
    // "10-15" where the unit is the same one and stands behind the 12 already.
    if (eta.ends_with(" s") && job.eta_high_seconds() < 59) {
        return fmt::format("{} left ({}-{})", eta, low.substr(0, low.size() - 2),
                           high.substr(0, high.size() - 2));
    }
    return fmt::format("{} left ({} - {})", eta, low, high);
}

std::optional<double> ShareDone(const v1::Job& job) {
    double done = static_cast<double>(job.samples_done());
    double all = static_cast<double>(job.samples_budget());
    if (job.has_eta_seconds()) {
        done = job.elapsed_seconds();
        all = done + job.eta_seconds();
    }
    return all > 0 ? std::optional(std::clamp(done / all, 0.0, 1.0)) : std::nullopt;
}

std::string FormatProgress(const v1::Job& job, std::optional<double> rate) {
    std::string text = StateAndReason(job);
    if (job.state() == v1::JOB_STATE_RENDERING || job.state() == v1::JOB_STATE_FILTERING) {
        const std::string details = Details(job, rate);
        text += details.empty() ? "" : ": " + details;
    }
    if (!job.held().empty()) {
        text += ", held: " + job.held();
    }
    return text;
}

std::string FormatBar(const v1::Job& job, std::optional<double> rate, int columns) {
    std::string bar(kBarWidth, ' ');
    const auto full = static_cast<std::size_t>(ShareDone(job).value_or(0) * kBarWidth);
    std::fill_n(bar.begin(), full, '=');
    if (full < bar.size() && job.state() == v1::JOB_STATE_RENDERING) {
        bar[full] = '>';
    }
    std::string text = fmt::format("[{}] {}", bar, Details(job, rate));
    if (!job.held().empty()) {
        text += ", held: " + job.held();
    } else if (job.state() != v1::JOB_STATE_RENDERING || job.paused()) {
        text += std::string(text.ends_with(' ') ? "" : ", ") + StateAndReason(job);
    }
    return text.substr(0, static_cast<std::size_t>(std::max(0, columns)));
}

}  // namespace relume::client
