#include "server/jobs/speed_meter.h"

#include <algorithm>

namespace relume::jobs {
namespace {

constexpr std::size_t kMostPoints = 128;
constexpr std::uint64_t kParts = 4;

}  // namespace

void SpeedMeter::Add(TimePoint now, std::uint64_t samples) {
    last_ = {now, last_.samples + samples};
    // Points stand at least 1/128 of all samples apart, so that their number is bounded.
    if (points_.empty() || last_.samples - points_.back().samples >= last_.samples / kMostPoints) {
        points_.push_back(last_);
    }
    if (points_.size() > 2 * kMostPoints) {
        std::size_t kept = 0;
        for (std::size_t i = 0; i < points_.size(); i += 2) {
            points_[kept++] = points_[i];
        }
        points_.resize(kept);
    }
}

SpeedMeter::Speed SpeedMeter::Get() const {
    if (points_.empty() || last_.time <= points_.front().time) {
        return {};
    }
    // The last point with at most `samples`, or the first of all.
    const auto at = [&](std::uint64_t samples) {
        auto it = std::upper_bound(
            points_.begin(), points_.end(), samples,
            [](std::uint64_t value, const Point& point) { return value < point.samples; });
        return it == points_.begin() ? points_.front() : *(it - 1);
    };
    const auto between = [](const Point& from, const Point& to) {
        const double seconds = ToSeconds(to.time - from.time);
        return seconds > 0 ? static_cast<double>(to.samples - from.samples) / seconds : 0;
    };
    const Point start = at(last_.samples / 2);
    Speed speed;
    speed.mean = between(start, last_);
    if (speed.mean <= 0) {
        // All of the newer half came at once.
        speed.mean = between(points_.front(), last_);
    }
    speed.low = speed.high = speed.mean;
    Point from = start;
    for (std::uint64_t part = 1; part <= kParts; ++part) {
        const Point to = part == kParts
                             ? last_
                             : at(start.samples + (last_.samples - start.samples) * part / kParts);
        if (const double s = between(from, to); s > 0) {
            speed.low = std::min(speed.low, s);
            speed.high = std::max(speed.high, s);
        }
        if (to.samples > from.samples) {
            from = to;
        }
    }
    return speed;
}

}  // namespace relume::jobs
