#pragma once

#include <cstdint>
#include <deque>
#include <optional>
#include <string>

#include "relume/v1/jobs.pb.h"

namespace relume::client {

// What a person wants to know of a job that runs, as text.

// "12 s", "3 min 05 s", "2 h 10 min"
std::string FormatDuration(double seconds);
// "999", "12.3 k", "1.23 M", "4.56 G"
std::string FormatCount(double count);

// Samples a second over the last few seconds, so that a worker that comes or goes shows.
class RateEstimate {
  public:
    // `seconds` and `samples` since the start; neither ever falls.
    void Add(double seconds, std::uint64_t samples);
    // Nothing before two points that are a little apart.
    std::optional<double> PerSecond() const;

  private:
    struct Point {
        double seconds;
        std::uint64_t samples;
    };
    std::deque<Point> points_;
};

// Newest estimate of the RelMSE: with a target of the image that the job would return, else of the
// unfiltered one; nothing before the first.
std::optional<double> EstimatedError(const v1::Job& job);

// "12 s left (10-15)", or "" if the server can't tell. A sampler may stop before.
std::string FormatEta(const v1::Job& job);

// How much of the work is done, 0 to 1, as far as budget or ETA tell.
std::optional<double> ShareDone(const v1::Job& job);

// "rendering: 45 %, pass 3, 1.23 M samples/s, estimated RelMSE 0.0123, 12 s left (10-15)"
std::string FormatProgress(const v1::Job& job, std::optional<double> rate);
// The same behind a bar, in at most `columns` characters.
std::string FormatBar(const v1::Job& job, std::optional<double> rate, int columns);

}  // namespace relume::client
