#pragma once

#include <cstdint>
#include <vector>

#include "core/base/clock.h"

namespace relume::jobs {

// How fast a farm renders a job: samples over wall time, of the newer half of its samples, since
// workers come and go and pixels differ. What passes before the first answer (scenes are loaded)
// does not count.
class SpeedMeter {
  public:
    // `samples` more are in. Times never fall.
    void Add(TimePoint now, std::uint64_t samples);

    // Samples a second: the mean, and the slowest and fastest parts that it is made of. All 0
    // before there is anything to tell.
    struct Speed {
        double mean = 0, low = 0, high = 0;
    };
    Speed Get() const;

  private:
    struct Point {
        TimePoint time;
        std::uint64_t samples = 0;  // up to then
    };
    std::vector<Point> points_;  // thinned out as they become many
    Point last_;
};

}  // namespace relume::jobs
