#pragma once

#include <cstdint>
#include <span>

namespace relume::jobs {

// How an image's error falls with its samples, as samples^-p. Only +, *, / and sqrt are used: what
// follows from it decides on samples and must have the same bits on every machine.

// The estimated error (RelMSE) of an image of so many samples.
struct ErrorPoint {
    std::uint64_t samples = 0;
    double error = 0;
};

// p in sixteenths.
struct Exponent {
    int sixteenths = 16;
    double value() const { return sixteenths / 16.0; }
};

// x^p for x > 0.
double Power(double x, Exponent p);
// x^(1/p) for 1 <= x, but at most `limit`.
double Root(double x, Exponent p, double limit);

// Of the unfiltered image p is 1: mean of independent samples. A filter's bias falls slower: p is
// fitted to the newest points, 0.3 to 1, and 0.7 for fewer than two.
Exponent FitExponent(std::span<const ErrorPoint> errors, bool filtered);

// p between two points, for reports and estimates; 0: can't be told.
double FallsBetween(const ErrorPoint& from, const ErrorPoint& to);

// The error expected at `samples`, from the newest point. Needs one.
double ExpectedError(std::span<const ErrorPoint> errors, Exponent p, double samples);

}  // namespace relume::jobs
