#include "proto/codec/budgets.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <functional>
#include <string>
#include <vector>

#include "core/base/error.h"

namespace relume::codec {
namespace {

using testing::HasSubstr;
using Change = std::function<void(v1::JobSpec*)>;

TEST(CheckBudgets, TakesAnyMixThatMakesSense) {
    for (const Change& change : std::vector<Change>{
             [](auto* s) { s->set_spp(0.25); }, [](auto* s) { s->set_spp(1 << 20); },
             [](auto* s) { s->set_max_spp(1); }, [](auto* s) { s->set_target(1e-9); },
             [](auto* s) { s->set_time_limit(0.01); },
             [](auto* s) {
                 s->set_spp(8);
                 s->set_min_spp(8);
                 s->set_max_spp(8);
                 s->set_target(0.01);
                 s->set_time_limit(20);
             },
             // The mean is never reached, which is no contradiction.
             [](auto* s) {
                 s->set_spp(64);
                 s->set_max_spp(32);
             }}) {
        v1::JobSpec spec;
        change(&spec);
        EXPECT_NO_THROW(CheckBudgets(spec)) << spec.ShortDebugString();
    }
}

TEST(CheckBudgets, SaysWhatMakesNone) {
    for (const auto& [change, said] : std::vector<std::pair<Change, std::string>>{
             {[](auto*) {}, "has no budget; set spp, max-spp, target or time-limit"},
             {[](auto* s) { s->set_min_spp(8); }, "has no budget"},
             {[](auto* s) { s->set_spp(-1); }, "spp -1: must be above 0 and at most 1048576"},
             {[](auto* s) { s->set_spp(std::nan("")); }, "spp nan"},
             {[](auto* s) { s->set_spp(HUGE_VAL); }, "spp inf"},
             {[](auto* s) { s->set_max_spp(0); }, "max-spp 0: must be above 0"},
             {[](auto* s) { s->set_max_spp(1u << 31); }, "max-spp 2147483648"},
             {[](auto* s) { s->set_min_spp(0); }, "min-spp 0"},
             {[](auto* s) { s->set_target(0); }, "target 0: must be above 0 and at most 1000"},
             {[](auto* s) { s->set_target(std::nan("")); }, "target nan"},
             {[](auto* s) { s->set_target(-0.1); }, "target -0.1"},
             {[](auto* s) { s->set_time_limit(0); }, "time-limit 0"},
             {[](auto* s) { s->set_time_limit(1e9); }, "at most 2592000"},
             {[](auto* s) { s->set_time_limit(HUGE_VAL); }, "time-limit inf"},
             {[](auto* s) {
                  s->set_min_spp(9);
                  s->set_max_spp(8);
              },
              "min-spp 9 is more than max-spp 8"},
             {[](auto* s) {
                  s->set_min_spp(9);
                  s->set_spp(8.5);
              },
              "min-spp 9 is more than spp 8.5"}}) {
        v1::JobSpec spec;
        change(&spec);
        try {
            CheckBudgets(spec);
            ADD_FAILURE() << spec.ShortDebugString();
        } catch (const Error& error) {
            EXPECT_EQ(error.code(), ErrorCode::kInvalidArgument);
            EXPECT_THAT(error.what(), HasSubstr(said));
        }
    }
}

}  // namespace
}  // namespace relume::codec
