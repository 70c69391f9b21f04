#include "core/base/param_set.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <functional>

#include "core/base/error.h"

namespace relume {
namespace {

using testing::ElementsAre;
using testing::HasSubstr;

std::string Fails(const std::function<void()>& action) {
    try {
        action();
    } catch (const Error& e) {
        EXPECT_EQ(e.code(), ErrorCode::kInvalidArgument);
        return e.what();
    }
    ADD_FAILURE() << "nothing was thrown";
    return "";
}

TEST(ParamSet, GivesWhatWasSetElseTheDefault) {
    ParamSet params;
    params.Set("flag", true);
    params.Set("size", 2.5f);
    params.Set("count", 7.0f);
    params.Set("color", std::vector<float>{1, 2, 3});
    params.Set("mode", "printed");
    EXPECT_TRUE(params.GetBool("flag", false));
    EXPECT_EQ(params.GetFloat("size", 0), 2.5f);
    EXPECT_EQ(params.GetInt("count", 0), 7);
    EXPECT_THAT(params.GetFloats("color", {0, 0, 0}), ElementsAre(1, 2, 3));
    EXPECT_EQ(params.GetString("mode", ""), "printed");
    EXPECT_TRUE(params.GetBool("absent", true));
    EXPECT_EQ(params.GetFloat("absent", -1), -1);
    EXPECT_EQ(params.GetInt("absent", -2), -2);
    EXPECT_THAT(params.GetFloats("absent", {4, 5}), ElementsAre(4, 5));
    EXPECT_EQ(params.GetString("absent", "corrected"), "corrected");
    EXPECT_TRUE(params.Has("mode"));
    EXPECT_FALSE(params.Has("absent"));
    params.Set("mode", "corrected");
    EXPECT_EQ(params.GetString("mode", ""), "corrected");
}

TEST(ParamSet, TextThatSpellsANumberOrABoolIsOne) {
    const ParamSet params =
        ParseNamedParams("f:a=1.5,b=-3,c=true,d=off,e=1,f=0,g=1e3,h=on,i=false").params;
    EXPECT_EQ(params.GetFloat("a", 0), 1.5f);
    EXPECT_EQ(params.GetInt("b", 0), -3);
    EXPECT_TRUE(params.GetBool("c", false));
    EXPECT_FALSE(params.GetBool("d", true));
    EXPECT_TRUE(params.GetBool("e", false));
    EXPECT_FALSE(params.GetBool("f", true));
    EXPECT_EQ(params.GetInt("g", 0), 1000);
    EXPECT_TRUE(params.GetBool("h", false));
    EXPECT_FALSE(params.GetBool("i", true));
    EXPECT_THAT(params.GetFloats("a", {0}), ElementsAre(1.5f));
}

TEST(ParamSet, AValueOfAnotherKindIsRejectedByName) {
    ParamSet params;
    params.Set("text", "1.5x");
    params.Set("infinite", "inf");
    params.Set("nan", std::nanf(""));
    params.Set("half", 0.5f);
    params.Set("huge", 1e9f);
    params.Set("flag", true);
    params.Set("color", std::vector<float>{1, 2, 3});
    EXPECT_THAT(Fails([&] { params.GetFloat("text", 0); }), HasSubstr("'text' must be one number"));
    EXPECT_THAT(Fails([&] { params.GetFloat("infinite", 0); }), HasSubstr("'infinite'"));
    EXPECT_THAT(Fails([&] { params.GetFloat("color", 0); }), HasSubstr("'color'"));
    EXPECT_THAT(Fails([&] { params.GetFloat("flag", 0); }), HasSubstr("'flag'"));
    EXPECT_THAT(Fails([&] { params.GetInt("half", 0); }), HasSubstr("'half' must be a whole"));
    EXPECT_THAT(Fails([&] { params.GetInt("nan", 0); }), HasSubstr("'nan'"));
    EXPECT_THAT(Fails([&] { params.GetInt("huge", 0); }), HasSubstr("'huge'"));
    EXPECT_THAT(Fails([&] { params.GetBool("half", false); }), HasSubstr("true or false"));
    EXPECT_THAT(Fails([&] { params.GetBool("text", false); }), HasSubstr("true or false"));
    EXPECT_THAT(Fails([&] { params.GetString("half", ""); }), HasSubstr("'half' must be a text"));
    EXPECT_THAT(Fails([&] { params.GetFloats("color", {0, 0}); }), HasSubstr("must be 2 numbers"));
    EXPECT_THAT(Fails([&] { params.GetFloats("flag", {}); }), HasSubstr("a list of numbers"));
}

TEST(ParamSet, AChoiceIsOneOfTheKnown) {
    ParamSet params;
    params.Set("mode", "prnted");
    EXPECT_THAT(Fails([&] {
                    params.GetChoice("mode", "corrected", {"printed", "corrected"});
                }),
                HasSubstr("mode=prnted: unknown; known: printed, corrected"));
    EXPECT_EQ(params.GetChoice("absent", "b", {"a", "b"}), "b");
}

TEST(ParamSet, WhatNobodyReadIsAMisspelling) {
    ParamSet params;
    params.Set("taylor", 8.0f);
    params.Set("taylr", 9.0f);
    params.GetInt("taylor", 0);
    params.GetFloat("sigma", 1);
    EXPECT_THAT(params.Unused(), ElementsAre("taylr"));
    const std::string message = Fails([&] { params.RejectUnused("bilateral"); });
    EXPECT_EQ(message, "bilateral: unknown parameter 'taylr'; known: sigma, taylor");
    params.GetInt("taylr", 0);
    params.RejectUnused("bilateral");
    ParamSet untouched;
    untouched.Set("a", 1.0f);
    EXPECT_THAT(Fails([&] { untouched.RejectUnused("none"); }), HasSubstr("known: none"));
}

TEST(ParseNamedParams, SplitsNameAndParameters) {
    NamedParams parsed = ParseNamedParams("bilateral:mode=printed,taylor=8");
    EXPECT_EQ(parsed.name, "bilateral");
    EXPECT_EQ(parsed.params.values().size(), 2u);
    EXPECT_EQ(parsed.params.GetString("mode", ""), "printed");
    EXPECT_EQ(parsed.params.GetInt("taylor", 0), 8);
    parsed = ParseNamedParams("none");
    EXPECT_EQ(parsed.name, "none");
    EXPECT_TRUE(parsed.params.values().empty());
    EXPECT_TRUE(ParseNamedParams("none:").params.values().empty());
    parsed = ParseNamedParams("model:path=a=b:c,empty=");
    EXPECT_EQ(parsed.params.GetString("path", ""), "a=b:c");
    EXPECT_EQ(parsed.params.GetString("empty", "x"), "");
}

TEST(ParseNamedParams, RejectsWhatIsNoKeyAndValue) {
    EXPECT_THAT(Fails([] { ParseNamedParams("a:b"); }), HasSubstr("'b' is not of the form"));
    EXPECT_THAT(Fails([] { ParseNamedParams("a:=1"); }), HasSubstr("'=1'"));
    EXPECT_THAT(Fails([] { ParseNamedParams("a:b=1,,c=2"); }), HasSubstr("''"));
}

}  // namespace
}  // namespace relume
