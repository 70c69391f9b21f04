#pragma once

#include <cstdio>
#include <functional>
#include <mutex>
#include <string>

#include "client/cli/progress.h"

namespace relume::client {

enum class ProgressStyle {
    kNone,   // notes and warnings only
    kLines,  // a line every few seconds and at each change of state
    kBar,    // one line, redrawn
};
// --quiet: none; a bar on a terminal, lines elsewhere.
ProgressStyle ChooseProgressStyle(bool quiet, std::FILE* out);

// Shows a job's progress. Thread-safe.
class ProgressMeter {
  public:
    // `clock` tells seconds from any start; for tests.
    ProgressMeter(ProgressStyle style, std::FILE* out, std::function<double()> clock = {});
    ~ProgressMeter() { Clear(); }

    // Stands before what Update shows from now on; the next job is another one.
    void Announce(const std::string& prefix);
    void Update(const v1::Job& job);
    void Upload(std::uint64_t done, std::uint64_t due);
    // A line that stays; not with kNone.
    void Note(const std::string& text);
    // A line that stays, whatever the style.
    void Warn(const std::string& text);
    // Takes the bar away.
    void Clear();

  private:
    bool Due();
    void Draw(const std::string& text);
    void Print(const std::string& text);

    const ProgressStyle style_;
    std::FILE* const out_;
    const std::function<double()> clock_;

    std::mutex mutex_;  // guards all below
    std::string prefix_;
    RateEstimate rate_;
    v1::JobState state_ = v1::JOB_STATE_UNSPECIFIED;  // shown last
    double drawn_ = -1e9;                             // when
    bool bar_ = false;                                // one is on the screen
};

}  // namespace relume::client
