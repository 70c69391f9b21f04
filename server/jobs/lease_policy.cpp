#include "server/jobs/lease_policy.h"

#include <algorithm>
#include <cmath>

namespace relume::jobs {

double PredictSeconds(const WorkerPace& pace, std::uint64_t samples) {
    if (!pace.scene_ready || pace.samples_per_second <= 0) {
        return 0;
    }
    // All threads share what is before; the lease itself is one thread's.
    const double before = static_cast<double>(pace.samples_before) / pace.samples_per_second;
    const double own = static_cast<double>(samples) * pace.threads / pace.samples_per_second;
    return std::min(kMaxPredictedSeconds, before + own);
}

double DeadlineSeconds(const WorkerPace& pace, std::uint64_t samples) {
    if (!pace.scene_ready) {
        return kSceneLoadSeconds;
    }
    if (pace.samples_per_second <= 0) {
        return kUnknownSpeedSeconds;
    }
    return std::max(kMinDeadlineSeconds, kDeadlineFactor * PredictSeconds(pace, samples));
}

bool ShouldRace(double own_seconds, double remaining_seconds) {
    return remaining_seconds <= -kRaceGainSeconds ||
           (own_seconds > 0 && own_seconds + kRaceGainSeconds <= remaining_seconds);
}

bool WouldBeLast(double own_seconds, std::uint64_t samples, std::uint64_t awaited,
                 double samples_per_second, int threads) {
    return own_seconds * samples_per_second >
           static_cast<double>(awaited) + static_cast<double>(samples) * threads;
}

double ProblemPauseSeconds(int n) { return std::min(60.0, std::pow(2.0, n - 1)); }

}  // namespace relume::jobs
