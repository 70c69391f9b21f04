#include "core/scene/render_settings.h"

#include <cmath>

#include "tests/unit/scene/gltf_file.h"

namespace relume::test {
namespace {

using testing::HasSubstr;

template <class F>
std::string Message(F&& change) {
    RenderSettings settings;
    settings.width = 64;
    settings.height = 48;
    ValidateSettings(settings);  // good so far
    change(&settings);
    return MessageOf([&] { ValidateSettings(settings); });
}

TEST(RenderSettings, WindowIsTheCropOrTheFrame) {
    RenderSettings settings;
    settings.width = 64;
    settings.height = 48;
    EXPECT_EQ(settings.Window(), (TileRect{0, 0, 64, 48}));
    settings.crop = {60, 40, 64, 48};
    EXPECT_NO_THROW(ValidateSettings(settings));
    EXPECT_EQ(settings.Window(), settings.crop);
}

TEST(RenderSettings, WrongOnesAreNamed) {
    EXPECT_THAT(Message([](RenderSettings* s) { s->width = 0; }), HasSubstr("size 0x48"));
    EXPECT_THAT(Message([](RenderSettings* s) { s->height = 1'000'000'000; }),
                HasSubstr("size 64x1000000000"));
    EXPECT_THAT(Message([](RenderSettings* s) { s->width = s->height = 65536; }),
                HasSubstr("pixels"));
    EXPECT_THAT(Message([](RenderSettings* s) { s->crop = {0, 0, 65, 48}; }), HasSubstr("crop"));
    EXPECT_THAT(Message([](RenderSettings* s) { s->crop = {8, 8, 8, 9}; }), HasSubstr("crop"));
    EXPECT_THAT(Message([](RenderSettings* s) { s->max_depth = 0; }), HasSubstr("max depth 0"));
    EXPECT_THAT(Message([](RenderSettings* s) { s->lens_radius = std::nanf(""); }),
                HasSubstr("lens radius"));
}

TEST(RenderSettings, CamerasOfTheirOwnAreChecked) {
    RenderSettings s;
    s.width = s.height = 8;
    s.look = LookCamera{{0, 0, 5}, {0, 0, 0}};
    EXPECT_NO_THROW(ValidateSettings(s));
    const auto refuses = [](RenderSettings settings) {
        try {
            ValidateSettings(settings);
            return false;
        } catch (const Error& error) {
            return error.code() == ErrorCode::kInvalidArgument;
        }
    };
    RenderSettings bad = s;
    bad.camera = "front";
    EXPECT_TRUE(refuses(bad));
    for (const LookCamera& look :
         {LookCamera{{0, 0, 5}, {0, 0, 5}}, LookCamera{{0, 0, 5}, {0, 9, 5}},
          LookCamera{{0, 0, 5}, {0, 0, 0}, {0, 0, 0}},
          LookCamera{{0, 0, 5}, {0, 0, 0}, {0, 1, 0}, 0.5f},
          LookCamera{{0, 0, 5}, {0, 0, 0}, {0, 1, 0}, 180},
          LookCamera{{0, 0, std::nanf("")}, {0, 0, 0}}}) {
        bad = s;
        bad.look = look;
        EXPECT_TRUE(refuses(bad));
    }
}

}  // namespace
}  // namespace relume::test
