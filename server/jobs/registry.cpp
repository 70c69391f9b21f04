#include <fmt/format.h>

#include "core/base/error.h"
#include "core/base/param_set.h"
#include "server/jobs/planner.h"

namespace relume::jobs {

std::unique_ptr<Planner> MakeUniform(const ParamSet& params);
std::unique_ptr<Planner> MakeAdaptive(const ParamSet& params);
std::unique_ptr<Planner> MakePaper(const ParamSet& params);
std::unique_ptr<Planner> MakeProbe(const ParamSet& params);
std::unique_ptr<Planner> MakeGem(const ParamSet& params);
std::unique_ptr<Planner> MakeNlm(const ParamSet& params);
std::unique_ptr<Planner> MakeSbf(const ParamSet& params);
std::unique_ptr<Planner> MakeRd(const ParamSet& params);
std::unique_ptr<Planner> MakeWlr(const ParamSet& params);

namespace {

// One entry a planner, and its prototype above; each is defined in the file of its name.
constexpr struct {
    const char* name;
    std::unique_ptr<Planner> (*make)(const ParamSet& params);
    const char* help;  // what it is, source; then a line a parameter: name=default, values, unit
} kPlanners[] = {
    {"uniform", MakeUniform,
     "the same number of samples everywhere\n"
     "    pilot=4          samples a pixel in the first pass; even, 2 to 4096\n"},
    {"adaptive", MakeAdaptive,
     "more samples where they change the image most; passes that double (Kirk, Arvo "
     "1991, Neyman 1934)\n"
     "    pilot=4          samples a pixel in the first pass; even, 4 to 4096\n"
     "    by=auto          filter: where the filter makes different images of the two halves, if "
     "the image is\n"
     "                     filtered; noise: where the samples are noisy, whatever follows; auto: "
     "as\n"
     "                     filter where a sample takes 3 rays or more, else as noise\n"},
    {"paper", MakePaper,
     "adaptive: pixels whose value still changes go on; Xing, Chen, Li 2020\n"
     "    mode=corrected   corrected: what we think was meant; printed: the paper's equations to "
     "the letter\n"
     "    alpha=1-2-4-8    samples that a pixel gets in a pass, by its change; or 1-4-16-32\n"
     "    pilot=4          samples a pixel in the first pass; even, 4 to 4096\n"
     "    passes=256       most passes, 1 to 10000\n"
     "    A pixel that has seen no light yet stops for good: rarely lit regions come out too "
     "dark.\n"},
    {"gem", MakeGem,
     "the plan of filter 'gem': the pixels with the worst error; Rousselle, Knaus, Zwicker 2011\n"
     "    pilot=4          samples a pixel in the first pass; even, 4 to 4096\n"
     "    passes=8         the rest of the budget is spent in so many, 1 to 1000\n"},
    {"nlm", MakeNlm,
     "the plan of filter 'nlm': where its halves differ; Rousselle, Knaus, Zwicker 2012\n"
     "    pilot=4, passes=8   as gem's\n"},
    {"sbf", MakeSbf,
     "the plan of filter 'sbf': by its estimate of the error (SURE); Li, Wu, Chuang 2012\n"
     "    pilot=8, passes=1   as gem's\n"},
    {"rd", MakeRd,
     "the plan of filter 'rd': by its estimate of the error; Rousselle, Manzi, Zwicker 2013\n"
     "    pilot=4, passes=3   as gem's\n"},
    {"wlr", MakeWlr,
     "the plan of filter 'wlr': by its variance and bias; Moon, Carr, Yoon 2014\n"
     "    pilot=4, passes=8   as gem's\n"},
    {"probe", MakeProbe,
     "many samples at a few random pixels, none elsewhere: what `relume verify` uses\n"
     "    pixels=1024      how many pixels, 1 to 1000000\n"
     "    spp=256          samples of each; even, 2 to 1000000; less if --spp allows no more\n"
     "    salt=0           another number, other pixels; 0 to 1000000\n"},
};

}  // namespace

std::unique_ptr<Planner> MakePlanner(const std::string& text) {
    const NamedParams named = ParseNamedParams(text);
    std::string known;
    for (const auto& entry : kPlanners) {
        if (named.name == entry.name) {
            auto planner = entry.make(named.params);
            named.params.RejectUnused("sampler '" + named.name + "'");
            return planner;
        }
        known += (known.empty() ? "" : ", ") + std::string(entry.name);
    }
    ThrowInvalidArgument(fmt::format("unknown sampler '{}'; known: {}", named.name, known));
}

std::vector<std::uint32_t> PlannedCounts(const PlanInput& input) {
    std::vector<std::uint32_t> planned(input.planned.begin(), input.planned.end());
    if (planned.empty()) {
        planned.resize(input.film.pixel_count());
        for (std::size_t i = 0; i < planned.size(); ++i) {
            planned[i] = input.film.NextIndex(i);
        }
    }
    return planned;
}

int ReadPilot(const ParamSet& params, const char* sampler, int otherwise, int least) {
    const int pilot = params.GetInt("pilot", otherwise);
    if (pilot < least || pilot > 4096 || pilot % 2 != 0) {
        ThrowInvalidArgument(fmt::format("sampler '{}': pilot={} must be even and {} to 4096",
                                         sampler, pilot, least));
    }
    return pilot;
}

std::string DescribePlanners() {
    std::string text;
    for (const auto& entry : kPlanners) {
        text += fmt::format("{:<11} {}", entry.name, entry.help);
    }
    return text;
}

}  // namespace relume::jobs
