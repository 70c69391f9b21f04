#include "server/denoise/sampling.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdlib>
#include <utility>

namespace relume::denoise {
namespace {

constexpr std::array<std::pair<const char*, double Sampling::*>, 2> kKeys = {
    {{"relume.rays", &Sampling::rays}, {"relume.falls", &Sampling::falls}}};

}  // namespace

Sampling ReadSampling(const std::map<std::string, std::string>& metadata) {
    Sampling sampling;
    for (const auto& [key, member] : kKeys) {
        const auto it = metadata.find(key);
        if (it != metadata.end()) {
            const double value = std::strtod(it->second.c_str(), nullptr);
            sampling.*member = std::isfinite(value) ? std::max(0.0, value) : 0;
        }
    }
    return sampling;
}

void WriteSampling(const Sampling& sampling, std::map<std::string, std::string>* metadata) {
    for (const auto& [key, member] : kKeys) {
        if (sampling.*member > 0) {
            (*metadata)[key] = fmt::format("{:.6g}", sampling.*member);
        }
    }
}

}  // namespace relume::denoise
