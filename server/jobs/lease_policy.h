#pragma once

#include <cstdint>

#include "core/base/clock.h"

namespace relume::jobs {

// When a lease counts as late and who may race for it: pure functions of numbers. A wrong guess
// costs time, never an image.

inline constexpr double kDeadlineFactor = 4;  // of the predicted time
inline constexpr double kMinDeadlineSeconds = 2;
inline constexpr double kMaxPredictedSeconds = 3600;
inline constexpr double kUnknownSpeedSeconds =
    30;                                           // deadline of a worker that has not been measured
inline constexpr double kSceneLoadSeconds = 120;  // deadline before the worker has loaded the scene
inline constexpr double kSilentSeconds = 10;      // without a report: the worker is taken for gone
inline constexpr double kRaceGainSeconds = 0.1;
inline constexpr std::size_t kMaxHolders = 2;  // of one unit that is raced for
inline constexpr int kMaxBadResults = 3;       // of one unit, then the job fails
inline constexpr int kMaxProblems = 5;  // of one worker without any progress, then the job fails

// What is known of the worker that gets a lease.
struct WorkerPace {
    double samples_per_second = 0;     // all threads; 0 = not measured
    int threads = 1;                   // each works on a lease of its own
    std::uint64_t samples_before = 0;  // of leases it has to finish first
    bool scene_ready = false;
};

// Seconds until an answer is expected, at most kMaxPredictedSeconds; 0 = no idea.
double PredictSeconds(const WorkerPace& pace, std::uint64_t samples);

// Seconds until the lease goes to another worker as well.
double DeadlineSeconds(const WorkerPace& pace, std::uint64_t samples);

// Whether an idle worker that needs `own_seconds` (0 = not known) should start on a lease that is
// expected back in `remaining_seconds` (below 0: overdue, or not known for so long): if that gains
// kRaceGainSeconds or more. Less is not worth a second answer.
bool ShouldRace(double own_seconds, double remaining_seconds);

// Whether a worker that needs `own_seconds` (0 = not known) for a unit of `samples` would be the
// last with it: after all `threads` threads, of `samples_per_second` together, would be through
// with the `awaited` samples, this unit among them, and one unit more.
bool WouldBeLast(double own_seconds, std::uint64_t samples, std::uint64_t awaited,
                 double samples_per_second, int threads);

// Pause of a worker after its n-th problem in a row with a job, n from 1.
double ProblemPauseSeconds(int n);

}  // namespace relume::jobs
