#include <fmt/format.h>

#include <charconv>
#include <cmath>
#include <limits>

#include "core/scene/obj.h"

namespace relume::obj {
namespace {

bool IsBlank(char c) { return c == ' ' || c == '\t' || c == '\r' || c == '\f' || c == '\v'; }

}  // namespace

bool Lines::Next() {
    words_.clear();
    while (at_ < bytes_.size()) {
        const char c = bytes_[at_];
        if (c == '\n') {
            ++at_;
            ++line_;
            line_begin_ = at_;
            if (!words_.empty()) {
                return true;
            }
        } else if (IsBlank(c)) {
            ++at_;
        } else if (c == '#') {
            at_ = std::min(bytes_.find('\n', at_), bytes_.size());
        } else if (c == '\\' &&
                   (bytes_.substr(at_ + 1, 1) == "\n" || bytes_.substr(at_ + 1, 2) == "\r\n")) {
            at_ = bytes_.find('\n', at_) + 1;
            ++line_;
            line_begin_ = at_;
        } else {
            if (words_.empty()) {
                first_line_ = line_;
                first_begin_ = line_begin_;
            }
            const std::size_t begin = at_;
            while (at_ < bytes_.size() && bytes_[at_] != '\n' && !IsBlank(bytes_[at_])) {
                ++at_;
            }
            words_.push_back(bytes_.substr(begin, at_ - begin));
        }
    }
    return !words_.empty();
}

Place Lines::At(std::size_t word) const {
    const auto begin = static_cast<std::size_t>(words_[word].data() - bytes_.data());
    return {name_, first_line_, static_cast<int>(begin - first_begin_) + 1};
}

std::string Lines::Rest(std::size_t word) const {
    if (word >= words_.size()) {
        return "";
    }
    const char* const begin = words_[word].data();
    const char* const end = words_.back().data() + words_.back().size();
    return std::string(begin, end);
}

float Lines::Number(std::size_t word) const {
    if (word >= words_.size()) {
        Fail(At(0), fmt::format("'{}' needs {} numbers, found {}; repair the line", words_[0], word,
                                words_.size() - 1));
    }
    std::string_view text = words_[word];
    if (text.size() > 1 && text.front() == '+') {
        text.remove_prefix(1);
    }
    double value = 0;
    const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), value);
    if (error == std::errc::invalid_argument || end != text.data() + text.size()) {
        Fail(At(word), fmt::format("expected a number, found '{}'; repair the line", text));
    }
    if (error == std::errc::result_out_of_range) {
        value = text.find("e-") != text.npos || text.find("E-") != text.npos
                    ? 0
                    : std::numeric_limits<double>::infinity();
    }
    if (!std::isfinite(value) || std::abs(value) > std::numeric_limits<float>::max()) {
        Fail(At(word),
             fmt::format("'{}' is not finite (NaN or infinity); export the scene again", text));
    }
    return static_cast<float>(value);
}

}  // namespace relume::obj
