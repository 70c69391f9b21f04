#pragma once

#include <map>
#include <set>
#include <string>
#include <vector>

#include "OpenImageDenoise/oidn.h"

namespace relume::denoise::stand_in {

// What one execution of a filter was asked for.
struct Run {
    std::set<std::string> images;  // but for the output
    std::map<std::string, int> parameters;
};
std::vector<Run>& Runs();

// The next execution fails so; OIDN_ERROR_NONE: it does not.
void Fail(OIDNError error, const std::string& message);

// Called between the halves of the next execution.
void OnHalf(void (*hook)(void*), void* user);

// How many filters there are.
int LiveFilters();

}  // namespace relume::denoise::stand_in
