#include "core/base/error.h"

#include <gtest/gtest.h>

#include <set>
#include <string>

namespace relume {
namespace {

TEST(Error, CarriesCodeAndMessage) {
    const Error error(ErrorCode::kDataLoss, "a.exr: truncated; restore the file");
    EXPECT_EQ(error.code(), ErrorCode::kDataLoss);
    EXPECT_STREQ(error.what(), "a.exr: truncated; restore the file");
}

TEST(Error, CodesHaveNamesOfTheirOwn) {
    std::set<std::string> names;
    for (int code = 0; code <= static_cast<int>(ErrorCode::kInternal); ++code) {
        names.insert(ToString(static_cast<ErrorCode>(code)));
    }
    EXPECT_EQ(names.size(), static_cast<std::size_t>(ErrorCode::kInternal) + 1);
    EXPECT_STREQ(ToString(ErrorCode::kResourceExhausted), "RESOURCE_EXHAUSTED");
}

TEST(Error, ShortcutsThrowTheirCode) {
    try {
        ThrowInvalidArgument("bad");
    } catch (const Error& e) {
        EXPECT_EQ(e.code(), ErrorCode::kInvalidArgument);
    }
    try {
        ThrowNotFound("gone");
    } catch (const Error& e) {
        EXPECT_EQ(e.code(), ErrorCode::kNotFound);
    }
    EXPECT_THROW(ThrowNotFound("gone"), std::runtime_error);
}

}  // namespace
}  // namespace relume
