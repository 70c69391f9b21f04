#include "server/jobs/unit_set.h"

#include <gtest/gtest.h>

#include <random>
#include <set>

namespace relume::jobs {
namespace {

TEST(UnitSet, IsASetOfNumbers) {
    UnitSet units;
    std::set<std::size_t> expected;
    std::mt19937 random(7);
    for (int step = 0; step < 5000; ++step) {
        const std::size_t unit = random() % 60;
        if (random() % 2 == 0) {
            EXPECT_EQ(units.Insert(unit), expected.insert(unit).second);
        } else {
            units.Erase(unit);
            expected.erase(unit);
        }
        ASSERT_EQ(units.size(), expected.size());
        const std::size_t from = random() % 62, parity = random() % 3;
        const auto wanted = [&](std::size_t u) { return parity == 2 || u % 2 == parity; };
        const auto found = std::find_if(expected.lower_bound(from), expected.end(), wanted);
        EXPECT_EQ(units.Find(from, wanted),
                  found == expected.end() ? std::nullopt : std::optional(*found));
    }
    units.clear();
    EXPECT_EQ(units.size(), 0u);
    EXPECT_FALSE(units.Find(0, [](std::size_t) { return true; }));
}

}  // namespace
}  // namespace relume::jobs
