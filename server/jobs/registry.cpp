#include <fmt/format.h>

#include "core/base/error.h"
#include "core/base/param_set.h"
#include "server/jobs/planner.h"

namespace relume::jobs {

std::unique_ptr<Planner> MakeUniform(const ParamSet& params);
std::unique_ptr<Planner> MakePaper(const ParamSet& params);

namespace {

// One line a planner, and its prototype above; each is defined in the file of its name.
constexpr struct {
    const char* name;
    std::unique_ptr<Planner> (*make)(const ParamSet& params);
} kPlanners[] = {
    {"uniform", MakeUniform},
    {"paper", MakePaper},
};

}  // namespace

std::unique_ptr<Planner> MakePlanner(const std::string& text) {
    const NamedParams named = ParseNamedParams(text);
    std::string known;
    for (const auto& [name, make] : kPlanners) {
        if (named.name == name) {
            auto planner = make(named.params);
            named.params.RejectUnused("sampler '" + named.name + "'");
            return planner;
        }
        known += (known.empty() ? "" : ", ") + std::string(name);
    }
    ThrowInvalidArgument(fmt::format("unknown sampler '{}'; known: {}", named.name, known));
}

}  // namespace relume::jobs
