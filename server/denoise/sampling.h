#pragma once

#include <map>
#include <string>

namespace relume::denoise {

// What is known of the making of a frame's samples, for filters that weigh their own time against
// that of more of these.
struct Sampling {
    double rays = 0;   // traced for a sample, mean; 0: not known
    double falls = 0;  // error of the unfiltered image: as samples to the power of minus that; 0
};

// As metadata relume.rays and relume.falls; what is not known, or no number, is 0 or left out.
Sampling ReadSampling(const std::map<std::string, std::string>& metadata);
void WriteSampling(const Sampling& sampling, std::map<std::string, std::string>* metadata);

}  // namespace relume::denoise
