#include "core/base/xxh64.h"

#include <bit>
#include <cstring>

namespace relume {
namespace {

static_assert(std::endian::native == std::endian::little, "lanes are read as they lie in memory");

constexpr std::uint64_t kPrime1 = 0x9E3779B185EBCA87, kPrime2 = 0xC2B2AE3D27D4EB4F,
                        kPrime3 = 0x165667B19E3779F9, kPrime4 = 0x85EBCA77C2B2AE63,
                        kPrime5 = 0x27D4EB2F165667C5;

template <typename T>
T Lane(const char* at) {
    T value;
    std::memcpy(&value, at, sizeof value);
    return value;
}

std::uint64_t Round(std::uint64_t sum, std::uint64_t lane) {
    return std::rotl(sum + lane * kPrime2, 31) * kPrime1;
}

std::uint64_t MergeRound(std::uint64_t sum, std::uint64_t other) {
    return (sum ^ Round(0, other)) * kPrime1 + kPrime4;
}

}  // namespace

std::uint64_t Xxh64(std::string_view bytes, std::uint64_t seed) {
    const char* at = bytes.data();
    const char* const end = at + bytes.size();
    std::uint64_t sum = seed + kPrime5;
    if (bytes.size() >= 32) {
        std::uint64_t a = seed + kPrime1 + kPrime2, b = seed + kPrime2, c = seed,
                      d = seed - kPrime1;
        for (; end - at >= 32; at += 32) {
            a = Round(a, Lane<std::uint64_t>(at));
            b = Round(b, Lane<std::uint64_t>(at + 8));
            c = Round(c, Lane<std::uint64_t>(at + 16));
            d = Round(d, Lane<std::uint64_t>(at + 24));
        }
        sum = std::rotl(a, 1) + std::rotl(b, 7) + std::rotl(c, 12) + std::rotl(d, 18);
        sum = MergeRound(MergeRound(MergeRound(MergeRound(sum, a), b), c), d);
    }
    sum += bytes.size();
    for (; end - at >= 8; at += 8) {
        sum = std::rotl(sum ^ Round(0, Lane<std::uint64_t>(at)), 27) * kPrime1 + kPrime4;
    }
    for (; end - at >= 4; at += 4) {
        sum = std::rotl(sum ^ (Lane<std::uint32_t>(at) * kPrime1), 23) * kPrime2 + kPrime3;
    }
    for (; at != end; ++at) {
        sum = std::rotl(sum ^ (static_cast<unsigned char>(*at) * kPrime5), 11) * kPrime1;
    }
    sum = (sum ^ (sum >> 33)) * kPrime2;
    sum = (sum ^ (sum >> 29)) * kPrime3;
    return sum ^ (sum >> 32);
}

}  // namespace relume
