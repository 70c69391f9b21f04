#include "client/cli/option_values.h"

#include <fmt/format.h>

#include <charconv>
#include <cstdint>
#include <string_view>
#include <vector>

#include "core/base/error.h"
#include "core/scene/render_settings.h"

namespace relume::client {
namespace {

// The whole of `text` as a number.
template <typename T>
bool Read(std::string_view text, T* value) {
    const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), *value);
    return error == std::errc() && end == text.data() + text.size();
}

// The numbers between separators; empty if `text` is anything else.
std::vector<double> ReadNumbers(std::string_view text, char separator) {
    std::vector<double> numbers;
    for (;;) {
        const std::size_t end = text.find(separator);
        double number = 0;
        if (!Read(text.substr(0, end), &number)) {
            return {};
        }
        numbers.push_back(number);
        if (end == std::string_view::npos) {
            return numbers;
        }
        text.remove_prefix(end + 1);
    }
}

bool IsWhole(double number, double low, double high) {
    return number >= low && number <= high && number == static_cast<std::int64_t>(number);
}

}  // namespace

Size ParseSize(const std::string& text) {
    const auto numbers = ReadNumbers(text, 'x');
    if (numbers.size() != 2) {
        ThrowInvalidArgument(fmt::format("--size {}: must be WIDTHxHEIGHT, e.g. 1280x720", text));
    }
    if (!IsWhole(numbers[0], 1, kMaxImageSide) || !IsWhole(numbers[1], 1, kMaxImageSide) ||
        numbers[0] * numbers[1] > static_cast<double>(kMaxImagePixels)) {
        ThrowInvalidArgument(
            fmt::format("--size {}: each side must be 1 to {}, and the image at most {} pixels",
                        text, kMaxImageSide, kMaxImagePixels));
    }
    return {static_cast<int>(numbers[0]), static_cast<int>(numbers[1])};
}

TileRect ParseCrop(const std::string& text) {
    const auto numbers = ReadNumbers(text, ',');
    if (numbers.size() != 4) {
        ThrowInvalidArgument(
            fmt::format("--crop {}: must be X0,Y0,X1,Y1, e.g. 100,50,300,200", text));
    }
    for (const double number : numbers) {
        if (!IsWhole(number, 0, kMaxImageSide)) {
            ThrowInvalidArgument(
                fmt::format("--crop {}: each number must be 0 to {}", text, kMaxImageSide));
        }
    }
    const TileRect crop{static_cast<int>(numbers[0]), static_cast<int>(numbers[1]),
                        static_cast<int>(numbers[2]), static_cast<int>(numbers[3])};
    if (crop.empty()) {
        ThrowInvalidArgument(
            fmt::format("--crop {}: is empty; X1 must be above X0, and Y1 above Y0", text));
    }
    return crop;
}

Vec3f ParseVector(const std::string& option, const std::string& text) {
    const auto numbers = ReadNumbers(text, ',');
    if (numbers.size() != 3) {
        ThrowInvalidArgument(
            fmt::format("{} {}: must be X,Y,Z, three numbers, e.g. 0,1.5,-4", option, text));
    }
    const Vec3f vector{static_cast<float>(numbers[0]), static_cast<float>(numbers[1]),
                       static_cast<float>(numbers[2])};
    if (!IsFinite(vector)) {
        ThrowInvalidArgument(fmt::format("{} {}: the numbers must be finite", option, text));
    }
    return vector;
}

double ParsePositive(const std::string& option, double most, const std::string& text) {
    double number = 0;
    if (!Read(text, &number) || !(number > 0) || number > most) {
        ThrowInvalidArgument(
            fmt::format("{} {}: must be a number above 0 and at most {:.0f}", option, text, most));
    }
    return number;
}

std::uint32_t ParseCount(const std::string& option, double most, const std::string& text) {
    double number = 0;
    if (!Read(text, &number) || !IsWhole(number, 1, most)) {
        ThrowInvalidArgument(
            fmt::format("{} {}: must be a whole number from 1 to {:.0f}", option, text, most));
    }
    return static_cast<std::uint32_t>(number);
}

}  // namespace relume::client
