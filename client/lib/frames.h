#pragma once

#include <cstddef>
#include <string>
#include <vector>

namespace relume::client {

// Frames of an animation, as render managers and compositors spell them.

inline constexpr int kMaxFrame = 9'999'999;
inline constexpr std::size_t kMaxFrames = 100'000;  // of one range
inline constexpr double kDefaultFps = 24;

// "1-48", "1-48x2" (every second one, from the first on), "48-1" (backwards), "1,5,9", "1..48", and
// any such with commas or spaces between, in this order; a frame that is named twice counts once,
// where it is named first: "1-100x10,1-100" renders every tenth frame first. Throws
// kInvalidArgument.
std::vector<int> ParseFrames(const std::string& text);

// Seconds into the animation at which the shutter of a frame opens: frame / fps, as Blender's
// exporter has it (frame 0 is at time 0, frame 24 of 24 fps at one second).
float FrameTime(int frame, double fps);

// "1-48", "1-47x2", "1,5,9": the shortest of these that ParseFrames reads, for messages.
std::string FormatFrames(const std::vector<int>& frames);

// A file name with a place for the frame's number: "out.####.exr" (as many digits as #, with zeros
// in front) or "out.%04d.exr".
class FramePattern {
  public:
    // Throws kInvalidArgument unless there is one such place; `option` is named.
    FramePattern(const std::string& option, const std::string& text);
    std::string Name(int frame) const;

  private:
    std::string before_, after_;
    int digits_ = 0;
};

}  // namespace relume::client
