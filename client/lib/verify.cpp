#include "client/lib/verify.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <charconv>
#include <cmath>
#include <span>
#include <vector>

#include "core/base/error.h"
#include "core/image/metrics.h"

namespace relume::client {
namespace {

constexpr double kNormal95 = 1.96;

using Rgb3 = std::array<std::span<const float>, 3>;

Rgb3 Planes(const Image& image, const std::string& layer) {
    const std::string prefix = layer.empty() ? "" : layer + ".";
    return {image.Plane(prefix + "R"), image.Plane(prefix + "G"), image.Plane(prefix + "B")};
}

bool SameWindow(const Image& a, const Image& b) {
    return a.width() == b.width() && a.height() == b.height() && a.x0() == b.x0() &&
           a.y0() == b.y0() && a.display_width() == b.display_width() &&
           a.display_height() == b.display_height();
}

// The numbers of a text, separated by single blanks.
std::vector<double> Numbers(const std::string& key, const std::string& text, std::size_t count) {
    std::vector<double> numbers;
    const char* at = text.data();
    const char* const end = at + text.size();
    while (numbers.size() < count) {
        double number = 0;
        const auto [next, problem] = std::from_chars(at, end, number);
        if (problem != std::errc() || !std::isfinite(number) || number < 0) {
            break;
        }
        numbers.push_back(number);
        at = next != end && *next == ' ' ? next + 1 : next;
    }
    if (numbers.size() != count || at != end) {
        ThrowInvalidArgument(fmt::format("metadata {} = '{}': must be {}, 0 or more", key, text,
                                         count == 1 ? "a number" : "two numbers"));
    }
    return numbers;
}

// Whether the error is far enough above 0 for its logarithm to be close to normal.
bool HasLogarithm(const MeasuredError& measured) {
    return measured.relmse > 2 * measured.standard_error;
}

}  // namespace

std::optional<Claim> ReadClaim(const Image& image, const std::string& key) {
    const auto& metadata = image.metadata();
    const auto value = metadata.find(key), interval = metadata.find(key + "_interval");
    if (value == metadata.end()) {
        return std::nullopt;
    }
    if (interval == metadata.end()) {
        ThrowInvalidArgument(fmt::format("metadata {} is there, {}_interval is not", key, key));
    }
    Claim claim;
    claim.relmse = Numbers(key, value->second, 1)[0];
    const auto ends = Numbers(interval->first, interval->second, 2);
    claim.low = ends[0];
    claim.high = ends[1];
    if (claim.low > claim.relmse || claim.high < claim.relmse) {
        ThrowInvalidArgument(fmt::format("metadata {} = '{}': must be around {}", interval->first,
                                         interval->second, value->second));
    }
    return claim;
}

MeasuredError MeasureError(const Image& image, const std::string& layer, const Image& probe) {
    if (!SameWindow(image, probe)) {
        ThrowInvalidArgument("image and probe have different windows");
    }
    const Rgb3 value = Planes(image, layer);
    const Rgb3 a = Planes(probe, "buffer_a"), b = Planes(probe, "buffer_b");
    const auto samples = probe.Plane("samples.Y");
    // A pixel that has lost more than half of its samples (they were not finite) may lack a half.
    const float enough = samples.empty() ? 0 : *std::ranges::max_element(samples) / 2;

    MeasuredError measured;
    double sum = 0, squares = 0, worst = 0;
    for (std::size_t i = 0; i < samples.size(); ++i) {
        if (!(samples[i] > enough)) {
            continue;
        }
        const int x = image.x0() + static_cast<int>(i % static_cast<std::size_t>(image.width()));
        const int y = image.y0() + static_cast<int>(i / static_cast<std::size_t>(image.width()));
        double error = 0;
        for (std::size_t c = 0; c < 3; ++c) {
            const double v = value[c][i], half_a = a[c][i], half_b = b[c][i];
            error +=
                (v - half_a) * (v - half_b) / (std::max(half_a * half_b, 0.0) + kRelMSEEpsilon) / 3;
        }
        if (!std::isfinite(error)) {
            ThrowInvalidArgument(fmt::format("pixel {},{} of {} is not finite", x, y,
                                             layer.empty() ? "the image" : "layer " + layer));
        }
        ++measured.pixels;
        sum += error;
        squares += error * error;
        if (error > worst) {
            worst = error;
            measured.worst_x = x;
            measured.worst_y = y;
        }
    }
    if (measured.pixels < 2) {
        ThrowInvalidArgument("fewer than two pixels were probed: no interval can be told");
    }
    const auto n = static_cast<double>(measured.pixels);
    measured.relmse = sum / n;
    measured.standard_error =
        std::sqrt(std::max(0.0, squares / n - measured.relmse * measured.relmse) / (n - 1));
    measured.worst_share = sum > 0 ? worst / sum : 0;
    const double margin = kNormal95 * measured.standard_error;
    if (HasLogarithm(measured)) {
        const double factor = std::exp(margin / measured.relmse);
        measured.low = measured.relmse / factor;
        measured.high = measured.relmse * factor;
    } else {
        measured.low = measured.relmse - margin;
        measured.high = measured.relmse + margin;
    }
    return measured;
}

bool Agree(const Claim& claim, const MeasuredError& measured) {
    const bool above = measured.relmse > claim.relmse;
    const double end = above ? claim.high : claim.low;
    const double margin = kNormal95 * measured.standard_error;
    if (!HasLogarithm(measured) || claim.relmse == 0) {
        return std::abs(measured.relmse - claim.relmse) <= std::hypot(end - claim.relmse, margin);
    }
    // An end at 0 is infinitely far on this scale: whatever lies on its side agrees.
    return std::abs(std::log(measured.relmse / claim.relmse)) <=
           std::hypot(std::log(end / claim.relmse), margin / measured.relmse);
}

}  // namespace relume::client
