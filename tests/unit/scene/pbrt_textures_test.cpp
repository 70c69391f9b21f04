#include <cmath>

#include "core/scene/pbrt_lights.h"
#include "tests/unit/scene/pbrt_file.h"

namespace relume::test {
namespace {

using testing::ElementsAre;
using testing::FloatNear;
using testing::HasSubstr;
using testing::Pointwise;

// What `Kd` of a matte material looks up, in its texture's own terms.
struct Seen {
    Scene scene;
    std::vector<float> factor;
    const Texture* texture = nullptr;
    const SceneImage* image = nullptr;
};
Seen LoadKd(const std::string& textures, PbrtFiles files = {}, bool decode = false) {
    files["a.tga"] = TgaPicture(4, 2, 255, 0, 0);
    files["b.tga"] = TgaPicture(2, 2, 0, 255, 0);
    Seen seen;
    seen.scene =
        LoadPbrtWorld(textures + " Material \"matte\" \"texture Kd\" \"t\"\n", files, decode);
    const Material& m = seen.scene.materials.at(0);
    seen.factor = Floats(m, "base_color");
    const int index = m.params.GetInt("base_color_texture", -1);
    if (index >= 0) {
        seen.texture = &seen.scene.textures.at(static_cast<std::size_t>(index));
        seen.image = &seen.scene.images.at(static_cast<std::size_t>(seen.texture->image));
    }
    return seen;
}
std::string Image(const std::string& name, const std::string& file, const std::string& more = "") {
    return "Texture \"" + name + "\" \"spectrum\" \"imagemap\" \"string filename\" \"" + file +
           "\" " + more + "\n";
}

TEST(PbrtTextures, ImageWithMapping) {
    const Seen plain = LoadKd(Image("t", "a.tga", "\"bool trilinear\" \"true\""));
    ASSERT_NE(plain.texture, nullptr);
    EXPECT_TRUE(plain.texture->srgb);
    EXPECT_THAT(plain.texture->uv_transform, ElementsAre(1, 0, 0, 0, 1, 0));
    EXPECT_THAT(plain.factor, ElementsAre(1, 1, 1));
    EXPECT_EQ(Text(plain.scene), "");
    const Seen mapped =
        LoadKd(Image("t", "a.tga",
                     "\"float uscale\" 2 \"float vscale\" 3 \"float udelta\" .25 \"float "
                     "vdelta\" .5 \"string wrap\" \"clamp\" \"string encoding\" \"linear\" "
                     "\"float scale\" .5"));
    EXPECT_FALSE(mapped.texture->srgb);
    EXPECT_EQ(mapped.texture->wrap_u, WrapMode::kClamp);
    EXPECT_THAT(mapped.factor, ElementsAre(0.5f, 0.5f, 0.5f));
    // pbrt's (u, v) = (0.5, 0.25), ours (0.5, 0.75): t = 1.25 up is row 1 - t down.
    const float* m = mapped.texture->uv_transform;
    EXPECT_NEAR(m[0] * 0.5f + m[1] * 0.75f + m[2], 1.25f, 1e-6f);
    EXPECT_NEAR(m[3] * 0.5f + m[4] * 0.75f + m[5], 1 - 1.25f, 1e-6f);
}

TEST(PbrtTextures, ConstantsFold) {
    const std::string constants =
        "Texture \"c\" \"spectrum\" \"constant\" \"rgb value\" [.2 .4 .6]\nTexture \"d\" "
        "\"spectrum\" "
        "\"constant\" \"rgb value\" [1 0 1]\n";
    EXPECT_THAT(
        LoadKd(
            constants +
            "Texture \"t\" \"spectrum\" \"scale\" \"texture tex1\" \"c\" \"rgb tex2\" [.5 .5 .5]")
            .factor,
        Pointwise(FloatNear(1e-6f), std::vector<float>{0.1f, 0.2f, 0.3f}));
    EXPECT_THAT(LoadKd(constants + "Texture \"t\" \"spectrum\" \"mix\" \"texture tex1\" \"c\" "
                                   "\"texture tex2\" \"d\" \"float amount\" .25")
                    .factor,
                Pointwise(FloatNear(1e-6f), std::vector<float>{0.4f, 0.3f, 0.7f}));
    const Seen scaled =
        LoadKd(Image("i", "a.tga") +
               "Texture \"t\" \"spectrum\" \"scale\" \"texture tex\" \"i\" \"float scale\" .25");
    EXPECT_THAT(scaled.factor, ElementsAre(0.25f, 0.25f, 0.25f));
    EXPECT_EQ(scaled.image->name, "a.tga");
}

TEST(PbrtTextures, CheckerboardIsFourTexels) {
    const Seen seen = LoadKd(
        "Texture \"t\" \"spectrum\" \"checkerboard\" \"float uscale\" 4 \"float vscale\" 2 \"rgb "
        "tex1\" [1 0 0] \"rgb tex2\" [0 0 1]");
    ASSERT_NE(seen.image, nullptr);
    EXPECT_TRUE(seen.texture->nearest);
    const auto red_at = [&](float u, float v) {
        const float* m = seen.texture->uv_transform;
        const float x = m[0] * u + m[1] * (1 - v) + m[2], y = m[3] * u + m[4] * (1 - v) + m[5];
        const int column = static_cast<int>((x - std::floor(x)) * 2),
                  row = static_cast<int>((y - std::floor(y)) * 2);
        return seen.image->floats[static_cast<std::size_t>(row * 2 + column) * 3];
    };
    for (const float u : {0.05f, 0.3f, 0.55f, 0.8f}) {
        for (const float v : {0.2f, 0.7f}) {
            const bool first = (static_cast<int>(u * 4) + static_cast<int>(v * 2)) % 2 == 0;
            EXPECT_EQ(red_at(u, v), first ? 1 : 0) << u << " " << v;
        }
    }
}

TEST(PbrtTextures, MixesOfPicturesAreBaked) {
    const std::string text = Image("a", "a.tga") + Image("b", "b.tga") +
                             "Texture \"t\" \"spectrum\" \"mix\" \"texture tex1\" \"a\" \"texture "
                             "tex2\" \"b\" \"float amount\" .25";
    const Seen sizes = LoadKd(text);
    EXPECT_EQ(sizes.image->width, 4);
    EXPECT_TRUE(sizes.image->bytes.empty());
    const Seen seen = LoadKd(text, {}, true);
    EXPECT_EQ(seen.scene.images.size(), 1u);  // the parts are not kept
    ASSERT_EQ(seen.image->bytes.size(), 4u * 2 * 3);
    EXPECT_TRUE(seen.texture->srgb);
    // sRGB of 0.75 and 0.25.
    EXPECT_THAT(std::vector<int>(seen.image->bytes.begin(), seen.image->bytes.begin() + 3),
                ElementsAre(225, 137, 0));
}

TEST(PbrtTextures, NumbersReadOneChannel) {
    PbrtFiles files;
    files["grey.tga"] = TgaPicture(2, 2, 90, 90, 90);
    files["color.tga"] = TgaPicture(2, 2, 255, 0, 0);
    const auto bump = [&](const char* file, const char* type) {
        const Scene scene = LoadPbrtWorld(
            std::string("Texture \"f\" \"float\" \"imagemap\" \"string filename\" \"") + file +
                "\" Texture \"g\" \"float\" \"scale\" \"texture tex1\" \"f\" \"float tex2\" .5 "
                "Material \"" +
                type + "\" \"texture " + (type[0] == 'm' ? "bumpmap" : "displacement") +
                "\" \"g\"\n",
            files, true);
        const Material& m = scene.materials.at(0);
        EXPECT_EQ(m.params.GetFloat("bump_scale", 0), 0.5f);
        return scene.images.at(static_cast<std::size_t>(
            scene.textures.at(static_cast<std::size_t>(m.params.GetInt("bump_texture", -1)))
                .image));
    };
    EXPECT_EQ(bump("grey.tga", "diffuse").name, "grey.tga");
    const SceneImage mean = bump("color.tga", "diffuse"), luminance = bump("color.tga", "matte");
    EXPECT_EQ(mean.channels, 1);
    EXPECT_NEAR(mean.floats[0], 1.0f / 3, 1e-5f);
    EXPECT_NEAR(luminance.floats[0], 0.2126f, 1e-5f);
}

TEST(PbrtTextures, RoughnessPicturesAreMapped) {
    PbrtFiles files;
    files["grey.tga"] = TgaPicture(1, 1, 64, 64, 64);
    const Scene scene = LoadPbrtWorld(
        "Texture \"f\" \"float\" \"imagemap\" \"string filename\" \"grey.tga\" \"string encoding\" "
        "\"linear\" "
        "Material \"conductor\" \"texture roughness\" \"f\"\n",
        files, true);
    const Material& m = scene.materials.at(0);
    const Texture& texture =
        scene.textures.at(static_cast<std::size_t>(m.params.GetInt("alpha_u_texture", -1)));
    EXPECT_NEAR(scene.images.at(static_cast<std::size_t>(texture.image)).floats[0],
                std::sqrt(64.0f / 255), 1e-5f);
    EXPECT_EQ(m.params.GetFloat("alpha_u", 0), 1);
}

TEST(PbrtTextures, NormalMapsAndDefaultCoordinates) {
    PbrtFiles files;
    files["n.tga"] = TgaPicture(1, 1, 128, 128, 255);
    const Scene scene =
        LoadPbrtWorld("Material \"diffuse\" \"string normalmap\" \"n.tga\"\n", files);
    EXPECT_FALSE(
        scene.textures
            .at(static_cast<std::size_t>(scene.materials.at(0).params.GetInt("normal_texture", -1)))
            .srgb);
    // pbrt gives triangles without uv (0,0) (1,0) (1,1).
    ASSERT_EQ(scene.meshes[0].uvs.size(), 3u);
    EXPECT_EQ(scene.meshes[0].uvs[2].x, 1);
    EXPECT_EQ(scene.meshes[0].uvs[2].y, 0);
}

TEST(PbrtTextures, HostileOnesEnd) {
    const auto message = [](const std::string& textures) {
        return MessageOf([&] { LoadKd(textures); });
    };
    EXPECT_THAT(message("Texture \"t\" \"spectrum\" \"scale\" \"texture tex1\" \"t\""),
                HasSubstr("refers to itself"));
    std::string doubling =
        "Texture \"x0\" \"spectrum\" \"imagemap\" \"string filename\" \"a.tga\"\n";
    for (int i = 1; i < 40; ++i) {
        const std::string last = "\"x" + std::to_string(i - 1) + "\"";
        doubling += "Texture \"x" + std::to_string(i) +
                    "\" \"spectrum\" \"mix\" \"texture tex1\" " + last + " \"texture tex2\" " +
                    last + "\n";
    }
    EXPECT_THAT(message(doubling + "Texture \"t\" \"spectrum\" \"scale\" \"texture tex1\" \"x39\""),
                HasSubstr("too many others"));
    EXPECT_THAT(message(""), HasSubstr("texture 't' is not known"));
    EXPECT_THAT(message("Texture \"t\" \"spectrum\" \"imagemap\""), HasSubstr("filename"));
    EXPECT_THAT(message(Image("t", "gone.tga")), HasSubstr("gone.tga"));
}

const Light& FirstLight(const Scene& scene) { return scene.lights.at(0); }

TEST(PbrtLights, DistantShinesFromItsSide) {
    const Scene scene = LoadPbrtWorld(
        "LightSource \"distant\" \"point from\" [0 5 0] \"point to\" [0 0 0] \"rgb L\" [1 2 3] "
        "\"rgb scale\" [2 2 2]\n");
    const Light& light = FirstLight(scene);
    EXPECT_EQ(light.type, "directional");
    EXPECT_THAT(light.params.GetFloats("irradiance", {}), ElementsAre(2, 4, 6));
    const Vec3f along = light.to_world.Vector({0, 0, -1});
    EXPECT_NEAR(along.y, -1, 1e-6f);
    const Scene lux = LoadPbrtWorld("LightSource \"distant\" \"float illuminance\" 50\n");
    EXPECT_THAT(FirstLight(lux).params.GetFloats("irradiance", {}), ElementsAre(50, 50, 50));
}

TEST(PbrtLights, PointAndSpot) {
    const Scene scene = LoadPbrtWorld(
        "Translate 1 2 3 LightSource \"point\" \"point3 from\" [1 0 0] \"rgb I\" [1 2 3] \"float "
        "power\" 12.566370\n");
    EXPECT_EQ(FirstLight(scene).to_world.Point({}), (Vec3f{2, 2, 3}));
    EXPECT_THAT(FirstLight(scene).params.GetFloats("intensity", {}),
                Pointwise(FloatNear(1e-5f), std::vector<float>{1, 2, 3}));
    const Scene spot = LoadPbrtWorld(
        "LightSource \"spot\" \"point from\" [0 0 2] \"point to\" [0 0 0] \"float coneangle\" 40 "
        "\"float conedeltaangle\" 10\n");
    const Light& light = FirstLight(spot);
    EXPECT_NEAR(light.to_world.Vector({0, 0, -1}).z, -1, 1e-6f);
    EXPECT_NEAR(light.params.GetFloat("outer_angle", 0), 40 * kPi / 180, 1e-5f);
    EXPECT_NEAR(light.params.GetFloat("inner_angle", 0), 30 * kPi / 180, 1e-5f);
    EXPECT_EQ(light.params.GetString("falloff", ""), "smoothstep");
}

TEST(PbrtLights, GoniometricMapsLieAsPbrtsDo) {
    PbrtFiles files;
    files["lamp.hdr"] = HdrPicture(8, 4, 128, 128, 128, 129);
    const auto load = [&](const char* map) {
        return LoadPbrtWorld(
            std::string("Translate 1 2 3\nLightSource \"goniometric\" \"rgb I\" [2 4 "
                        "6] \"string ") +
                map + "\" \"lamp.hdr\"\n",
            files, true);
    };
    // Where Scene's map has a direction of the world.
    const auto uv = [](const Light& light, Vec3f world) {
        const Vec3f d = light.to_world.Inverse().Vector(world);
        return Vec2f{0.5f + std::atan2(d.x, -d.z) / (2 * kPi), std::acos(d.y) / kPi};
    };
    const Scene v3 = load("mapname");
    const Light& light = v3.lights.at(0);
    EXPECT_EQ(light.type, "goniometric");
    EXPECT_EQ(light.params.GetFloats("intensity", {}), (std::vector<float>{2, 4, 6}));
    EXPECT_EQ(light.to_world.Point({0, 0, 0}), (Vec3f{1, 2, 3}));
    const SceneImage& image =
        v3.images.at(static_cast<std::size_t>(light.params.GetInt("image", -1)));
    EXPECT_EQ(image.width, 8);
    EXPECT_EQ(image.floats.size(), 96u);
    // pbrt-v3: y up, phi counts from +x to +z.
    EXPECT_NEAR(uv(light, {0, 1, 0}).y, 0, 1e-3f);
    EXPECT_NEAR(uv(light, {0, 0, 1}).x, 0.25f, 1e-5f);
    EXPECT_NEAR(uv(light, {-1, 0, 0}).x, 0.5f, 1e-5f);
    EXPECT_NEAR(uv(light, {0, 0, -1}).x, 0.75f, 1e-5f);
    // pbrt-v4 swaps them too.
    EXPECT_NEAR(uv(load("filename").lights.at(0), {0, 1, 0}).y, 0, 1e-3f);
    // Without a picture it is a point light.
    EXPECT_EQ(LoadPbrtWorld("LightSource \"goniometric\"\n").lights.at(0).type, "point");
}

TEST(PbrtLights, EnvironmentMapsLieAsPbrtsDo) {
    PbrtFiles files;
    files["sky.hdr"] = HdrPicture(8, 4, 128, 128, 128, 129);
    const Scene scene = LoadPbrtWorld(
        "LightSource \"infinite\" \"string mapname\" \"sky.hdr\" \"rgb L\" [2 2 2]\n", files);
    ASSERT_NE(scene.environment, nullptr);
    EXPECT_EQ(scene.environment->color, (Rgb{2, 2, 2}));
    const Transform to_light = scene.environment->to_world.Inverse();
    // pbrt-v3: phi counts from +x to +y round +z, u = phi / 2 pi; v from +z down.
    const auto uv = [&](Vec3f world) {
        const Vec3f d = to_light.Vector(Normalize(world));
        float u = 0.5f + std::atan2(d.x, -d.z) / (2 * kPi);
        u -= std::floor(u);
        return Vec2f{u, std::acos(d.y) / kPi};
    };
    EXPECT_NEAR(uv({0, 1, 0}).x, 0.25f, 1e-5f);
    EXPECT_NEAR(uv({-1, 0, 0}).x, 0.5f, 1e-5f);
    EXPECT_NEAR(uv({0, -1, 0}).x, 0.75f, 1e-5f);
    EXPECT_NEAR(uv({0, 0.001f, 1}).y, 0, 1e-3f);
    const Scene turned = LoadPbrtWorld(
        "Rotate 90 0 0 1 LightSource \"infinite\" \"string mapname\" \"sky.hdr\"\n", files);
    const Vec3f d = turned.environment->to_world.Inverse().Vector({-1, 0, 0});
    EXPECT_NEAR(0.5f + std::atan2(d.x, -d.z) / (2 * kPi), 0.25f, 1e-5f);
    EXPECT_EQ(LoadPbrtWorld("LightSource \"infinite\" \"rgb L\" [1 2 3]\n").environment->color,
              (Rgb{1, 2, 3}));
}

TEST(PbrtLights, EqualAreaMapsAreResampled) {
    using pbrt::EqualAreaSquare;
    EXPECT_NEAR(EqualAreaSquare({0, 0, 1}).x, 0.5f, 1e-6f);
    EXPECT_NEAR(EqualAreaSquare({1, 0, 0}).x, 1, 1e-6f);
    EXPECT_NEAR(EqualAreaSquare({0, 1, 0}).y, 1, 1e-6f);
    const Vec2f low = EqualAreaSquare({0, 0, -1});
    EXPECT_NEAR(std::abs(low.x - 0.5f) + std::abs(low.y - 0.5f), 1, 1e-6f);
    // Upper hemisphere: the inner diamond, half of the square.
    const Vec2f up = EqualAreaSquare(Normalize(Vec3f{0.3f, -0.5f, 0.2f}));
    EXPECT_LT(std::abs(up.x - 0.5f) + std::abs(up.y - 0.5f), 0.5f);
    EXPECT_LT(up.y, 0.5f);
    PbrtFiles files;
    files["sky.hdr"] = HdrPicture(4, 4, 128, 64, 32, 129);
    const Scene scene =
        LoadPbrtWorld("LightSource \"infinite\" \"string filename\" \"sky.hdr\"\n", files, true);
    const SceneImage& map = scene.images.at(static_cast<std::size_t>(scene.environment->image));
    EXPECT_EQ(map.width, 8);
    EXPECT_EQ(map.height, 4);
    ASSERT_EQ(map.floats.size(), 8u * 4 * 3);
    for (std::size_t i = 0; i < map.floats.size(); i += 3) {
        EXPECT_NEAR(map.floats[i], 1, 0.01f);
        EXPECT_NEAR(map.floats[i + 2], 0.25f, 0.01f);
    }
}

}  // namespace
}  // namespace relume::test
