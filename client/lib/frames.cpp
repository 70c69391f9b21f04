#include "client/lib/frames.h"

#include <fmt/format.h>

#include <algorithm>
#include <charconv>
#include <string_view>
#include <unordered_set>

#include "core/base/error.h"

namespace relume::client {
namespace {

[[noreturn]] void Fail(const std::string& text, const std::string& problem) {
    ThrowInvalidArgument(
        fmt::format("--frames '{}': {}; e.g. 1-48, 1-48x2 or 1,5,9", text, problem));
}

// What is left to read of a range.
class Reader {
  public:
    Reader(const std::string& text, std::string_view part) : text_(text), left_(part) {}

    bool done() const { return left_.empty(); }
    bool Take(std::string_view what) {
        if (!left_.starts_with(what)) {
            return false;
        }
        left_.remove_prefix(what.size());
        return true;
    }
    int Number(const char* what) {
        if (left_.starts_with('-')) {
            Fail(text_, fmt::format("a {} below 0 is before the animation's start", what));
        }
        int number = 0;
        const auto [end, error] =
            std::from_chars(left_.data(), left_.data() + left_.size(), number);
        if (error == std::errc::result_out_of_range || number > kMaxFrame) {
            Fail(text_, fmt::format("a {} is above {}", what, kMaxFrame));
        }
        if (error != std::errc()) {
            Fail(text_, left_.empty() ? fmt::format("a {} is missing", what)
                                      : fmt::format("'{}' is no {}", left_, what));
        }
        left_.remove_prefix(static_cast<std::size_t>(end - left_.data()));
        return number;
    }
    std::string_view left() const { return left_; }

  private:
    const std::string& text_;
    std::string_view left_;
};

}  // namespace

std::vector<int> ParseFrames(const std::string& text) {
    constexpr std::string_view kBetween = ", \t";
    std::vector<int> frames;
    std::unordered_set<int> seen;
    std::string_view left = text;
    for (;;) {
        left.remove_prefix(std::min(left.find_first_not_of(kBetween), left.size()));
        if (left.empty()) {
            break;
        }
        const std::size_t length = std::min(left.find_first_of(kBetween), left.size());
        Reader part(text, left.substr(0, length));
        left.remove_prefix(length);

        const int first = part.Number("frame");
        int last = first, step = 1;
        if (part.Take("-") || part.Take("..")) {
            last = part.Number("frame");
            if (part.Take("x")) {
                step = part.Number("step");
            }
        }
        if (!part.done()) {
            Fail(text, fmt::format("'{}' is not understood", part.left()));
        }
        if (step == 0) {
            Fail(text, "a step must be at least 1");
        }
        const int way = last < first ? -step : step;
        for (int frame = first; way > 0 ? frame <= last : frame >= last; frame += way) {
            if (seen.insert(frame).second) {
                frames.push_back(frame);
            }
            if (frames.size() > kMaxFrames) {
                Fail(text, fmt::format("more than {} frames", kMaxFrames));
            }
        }
    }
    if (frames.empty()) {
        Fail(text, "no frame is named");
    }
    return frames;
}

float FrameTime(int frame, double fps) { return static_cast<float>(frame / fps); }

std::string FormatFrames(const std::vector<int>& frames) {
    std::string text;
    for (std::size_t i = 0; i < frames.size();) {
        // The longest run with one step from here on.
        std::size_t end = i + 1;
        const int step = end < frames.size() ? frames[end] - frames[i] : 0;
        while (step > 0 && end < frames.size() && frames[end] - frames[end - 1] == step) {
            ++end;
        }
        text += text.empty() ? "" : ",";
        if (end - i < 3) {  // "1,5" is no longer than "1-5x4"
            end = i + 1;
            text += fmt::format("{}", frames[i]);
        } else {
            text += fmt::format("{}-{}", frames[i], frames[end - 1]);
            text += step > 1 ? fmt::format("x{}", step) : "";
        }
        i = end;
    }
    return text;
}

FramePattern::FramePattern(const std::string& option, const std::string& text) {
    const auto fail = [&](const char* problem) {
        ThrowInvalidArgument(fmt::format(
            "{} {}: {}: say where the frame's number goes, as in out.####.exr or out.%04d.exr",
            option, text, problem));
    };
    // Folders are taken as they are. A run of # ends where another character stands; %d may have a
    // width in between.
    const std::size_t folder = text.rfind('/') + 1;  // npos + 1 is 0
    std::size_t place = text.find_first_of("#%", folder), end = place;
    if (place == std::string::npos) {
        fail("all frames would go into one file");
    }
    if (text[place] == '#') {
        end = std::min(text.find_first_not_of('#', place), text.size());
        digits_ = static_cast<int>(end - place);
    } else {
        end = text.find('d', place);
        const std::string width =
            end == std::string::npos ? "x" : text.substr(place + 1, end - place - 1);
        const bool padded = width.size() == 2 && width[0] == '0' && width[1] > '0';
        if (!width.empty() && (!padded || width[1] > '9')) {
            fail("a % must be that of %d or %04d");
        }
        digits_ = padded ? width[1] - '0' : 1;
        ++end;
    }
    if (digits_ > 9) {
        fail("more than 9 digits");
    }
    before_ = text.substr(0, place);
    after_ = text.substr(end);
    if (after_.find_first_of("#%") != std::string::npos) {
        fail("there is more than one place for it");
    }
}

std::string FramePattern::Name(int frame) const {
    return fmt::format("{}{:0{}}{}", before_, frame, digits_, after_);
}

}  // namespace relume::client
