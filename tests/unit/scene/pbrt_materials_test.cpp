#include <cmath>

#include "tests/unit/scene/pbrt_file.h"

namespace relume::test {
namespace {

using testing::ElementsAre;
using testing::FloatNear;
using testing::HasSubstr;
using testing::IsEmpty;
using testing::Pointwise;

// Scene of one material on a triangle that follows.
Scene LoadMaterial(const std::string& text, const PbrtFiles& files = {}) {
    return LoadPbrtWorld(text + "\n", files);
}
Material First(const std::string& text) { return LoadMaterial(text).materials.at(0); }

void ExpectFloats(const Material& material, const char* name, std::vector<float> expected) {
    EXPECT_THAT(Floats(material, name), Pointwise(FloatNear(1e-4f), expected)) << name;
}

TEST(PbrtMaterials, WithoutOneItIsGrey) {
    const Material m = First("");
    EXPECT_EQ(m.type, "diffuse");
    ExpectFloats(m, "base_color", {0.5f, 0.5f, 0.5f});
}

TEST(PbrtMaterials, Matte) {
    const Material m = First("Material \"matte\" \"rgb Kd\" [.1 .2 .3] \"float sigma\" 20");
    EXPECT_EQ(m.type, "diffuse");
    ExpectFloats(m, "base_color", {0.1f, 0.2f, 0.3f});
    ExpectFloats(m, "sigma", {20});
}

TEST(PbrtMaterials, CoatsReflectWhatPbrtsDo) {
    // Straight on, a coat of index n reflects ((n - 1) / (n + 1))^2.
    const auto straight = [](const Material& m) {
        const float n = m.params.GetFloat("ior", 0);
        return (n - 1) * (n - 1) / ((n + 1) * (n + 1));
    };
    const Material substrate = First(
        "Material \"substrate\" \"rgb Ks\" [.04 .04 .04] \"float uroughness\" .1 \"float "
        "vroughness\" .2 \"bool remaproughness\" \"false\"");
    EXPECT_EQ(substrate.type, "coated_diffuse");
    EXPECT_NEAR(straight(substrate), 0.04f, 1e-5f);
    ExpectFloats(substrate, "alpha_u", {0.1f});
    ExpectFloats(substrate, "alpha_v", {0.2f});
    EXPECT_NEAR(straight(First("Material \"plastic\" \"rgb Ks\" [.5 .5 .5]")), 0.02f, 1e-5f);
    EXPECT_NEAR(First("Material \"plastic\" \"rgb Ks\" [1 1 1]").params.GetFloat("ior", 0), 1.5f,
                1e-4f);
    const Material v4 =
        First("Material \"coateddiffuse\" \"rgb reflectance\" [1 0 0] \"float roughness\" .25");
    EXPECT_EQ(v4.type, "coated_diffuse");
    ExpectFloats(v4, "alpha_u", {0.5f});  // the square root
    ExpectFloats(v4, "ior", {1.5f});
}

TEST(PbrtMaterials, Version3MapsRoughness) {
    // 3rd edition, section 8.4: at 1 the polynomial is its constant.
    ExpectFloats(First("Material \"plastic\" \"float roughness\" 1"), "alpha_u", {1.62142f});
    ExpectFloats(First("Material \"glass\""), "alpha_u", {0});
}

TEST(PbrtMaterials, Conductors) {
    const Material metal = First(
        "Material \"metal\" \"rgb eta\" [1 2 3] \"rgb k\" [4 5 6] \"bool remaproughness\" "
        "\"false\"");
    EXPECT_EQ(metal.type, "conductor");
    ExpectFloats(metal, "eta", {1, 2, 3});
    ExpectFloats(metal, "k", {4, 5, 6});
    ExpectFloats(metal, "alpha_u", {0.01f});
    const Material named = First(
        "Material \"conductor\" \"spectrum eta\" \"metal-Au-eta\" \"spectrum k\" \"metal-Au-k\"");
    ExpectFloats(named, "eta", {0.143119f, 0.374957f, 1.442479f});
    ExpectFloats(First("Material \"conductor\" \"rgb reflectance\" [.5 .6 .7]"), "reflectance",
                 {0.5f, 0.6f, 0.7f});
    const Material mirror = First("Material \"mirror\"");
    ExpectFloats(mirror, "reflectance", {0.9f, 0.9f, 0.9f});
    EXPECT_FALSE(mirror.params.GetBool("fresnel", true));
    const Material coated = First(
        "Material \"coatedconductor\" \"float interface.roughness\" .04 \"float "
        "conductor.roughness\" "
        ".09 \"float interface.eta\" 1.4");
    EXPECT_EQ(coated.type, "coated_conductor");
    ExpectFloats(coated, "alpha_u", {0.2f});
    ExpectFloats(coated, "conductor_alpha_v", {0.3f});
    ExpectFloats(coated, "ior", {1.4f});
}

TEST(PbrtMaterials, GlassAndItsInside) {
    const Material glass = First("Material \"glass\" \"float index\" 1.3 \"rgb Kt\" [.5 .6 .7]");
    EXPECT_EQ(glass.type, "dielectric");
    ExpectFloats(glass, "ior", {1.3f});
    ExpectFloats(glass, "tint", {0.5f, 0.6f, 0.7f});
    ExpectFloats(First("Material \"dielectric\" \"spectrum eta\" \"glass-BK7\""), "ior", {1.5168f});
    EXPECT_EQ(First("Material \"thindielectric\"").type, "thin_dielectric");
    const Scene scene = LoadMaterial(
        "MakeNamedMedium \"green\" \"string type\" \"homogeneous\" \"rgb sigma_a\" [.5 .2 .4] "
        "\"rgb "
        "sigma_s\" [0 0 0] \"float scale\" 2\nMediumInterface \"green\" \"\"\nMaterial "
        "\"dielectric\"");
    ExpectFloats(scene.materials[0], "absorption", {1, 0.4f, 0.8f});
    EXPECT_THAT(scene.notes, IsEmpty());
    EXPECT_THAT(Text(LoadMaterial("MakeNamedMedium \"fog\" \"string type\" \"homogeneous\"\n"
                                  "MediumInterface \"fog\"\nMaterial \"dielectric\"")),
                testing::AllOf(HasSubstr("scattering in media"), HasSubstr("around shapes")));
    EXPECT_THAT(MessageOf([] { LoadMaterial("MediumInterface \"x\" \"\" Material \"glass\""); }),
                HasSubstr("medium 'x' is not known"));
}

TEST(PbrtMaterials, TransmittingOnes) {
    const Material v4 = First(
        "Material \"diffusetransmission\" \"rgb reflectance\" [.2 .2 .2] \"rgb transmittance\" [.4 "
        ".4 "
        ".4] \"float scale\" .5");
    EXPECT_EQ(v4.type, "diffuse_transmission");
    ExpectFloats(v4, "base_color", {0.1f, 0.1f, 0.1f});
    ExpectFloats(v4, "transmittance", {0.2f, 0.2f, 0.2f});
    const Material v3 = First(
        "Material \"translucent\" \"rgb Kd\" [.5 .5 .5] \"rgb Ks\" [0 0 0] \"rgb transmit\" [1 1 "
        "1]");
    ExpectFloats(v3, "base_color", {0.25f, 0.25f, 0.25f});
    ExpectFloats(v3, "transmittance", {0.5f, 0.5f, 0.5f});
}

TEST(PbrtMaterials, Mixes) {
    const std::string parts =
        "MakeNamedMaterial \"a\" \"string type\" \"matte\"\nMakeNamedMaterial \"b\" \"string "
        "type\" "
        "\"mirror\"\n";
    const auto share_of_mirror = [](const Scene& scene) {
        const Material& mix =
            scene.materials.at(static_cast<std::size_t>(scene.meshes[0].material));
        EXPECT_EQ(mix.type, "mix");
        const float amount = mix.params.GetFloat("amount", -1);
        const int b = mix.params.GetInt("material_b", -1);
        return scene.materials.at(static_cast<std::size_t>(b)).type == "conductor" ? amount
                                                                                   : 1 - amount;
    };
    // Version 4: the second one's share; version 3: the first one's.
    EXPECT_NEAR(
        share_of_mirror(LoadMaterial(parts + "Material \"mix\" \"string materials\" [\"a\" \"b\"] "
                                             "\"float amount\" .2")),
        0.2f, 1e-6f);
    EXPECT_NEAR(share_of_mirror(LoadMaterial(
                    parts + "Material \"mix\" \"string namedmaterial1\" \"a\" \"string "
                            "namedmaterial2\" \"b\" \"rgb amount\" [.2 .2 .2]")),
                0.8f, 1e-6f);
    EXPECT_THAT(
        MessageOf([] {
            LoadMaterial(
                "MakeNamedMaterial \"m\" \"string type\" \"mix\" \"string materials\" [\"m\" "
                "\"m\"] NamedMaterial \"m\"");
        }),
        HasSubstr("contains itself"));
}

TEST(PbrtMaterials, LaterDeclarationsOfANameDoNotReachBack) {
    const Scene scene = LoadMaterial(
        std::string("MakeNamedMaterial \"m\" \"string type\" \"matte\" NamedMaterial \"m\"\n") +
        kPbrtTriangle + "MakeNamedMaterial \"m\" \"string type\" \"mirror\" NamedMaterial \"m\"");
    EXPECT_EQ(scene.materials[static_cast<std::size_t>(scene.meshes[0].material)].type, "diffuse");
    EXPECT_EQ(scene.materials[static_cast<std::size_t>(scene.meshes[1].material)].type,
              "conductor");
}

TEST(PbrtMaterials, AreaLightsShineFromTheirFront) {
    const std::string lamp =
        "Material \"matte\" AreaLightSource \"diffuse\" \"rgb L\" [1 2 3] \"rgb scale\" [2 2 2]";
    const Scene scene = LoadMaterial(lamp + " \"bool twosided\" \"false\"");
    const Material& m = scene.materials[static_cast<std::size_t>(scene.meshes[0].material)];
    ExpectFloats(m, "emissive", {2, 4, 6});
    EXPECT_FALSE(m.params.GetBool("double_sided", false));
    EXPECT_TRUE(scene.HasLight());
    const Scene both = LoadMaterial(lamp + " \"bool twosided\" \"true\"");
    EXPECT_TRUE(both.materials[static_cast<std::size_t>(both.meshes[0].material)].params.GetBool(
        "double_sided", false));
}

TEST(PbrtMaterials, PowerOfAnAreaLight) {
    // A disk of radius 2: L = power / (pi area).
    const Scene scene = LoadPbrtText(
        "WorldBegin AreaLightSource \"diffuse\" \"float power\" 100 Shape \"disk\" \"float "
        "radius\" 2");
    EXPECT_NEAR(Floats(scene.materials.back(), "emissive")[0], 100 / (M_PI * 4 * M_PI), 1e-3);
}

TEST(PbrtMaterials, AlphaAndSurfacesThatAreNone) {
    const std::string shape = "Shape \"sphere\" ";
    EXPECT_EQ(LoadMaterial(shape + "\"float alpha\" 0").meshes.size(), 1u);
    const Scene half = LoadMaterial(shape + "\"float alpha\" .5");
    const Material& m = half.materials[static_cast<std::size_t>(half.meshes[0].material)];
    ExpectFloats(m, "alpha", {0.5f});
    EXPECT_EQ(m.params.GetString("alpha_mode", ""), "blend");
    EXPECT_NE(half.meshes[1].material, half.meshes[0].material);
    EXPECT_EQ(LoadPbrtText(
                  std::string(
                      "WorldBegin Material \"interface\" Shape \"sphere\" Material \"diffuse\"\n") +
                  kPbrtTriangle)
                  .meshes.size(),
              1u);
}

TEST(PbrtMaterials, DisneyAndUnknownOnesAreClose) {
    const Material disney = First(
        "Material \"disney\" \"rgb color\" [.1 .2 .3] \"float metallic\" .7 \"float roughness\" "
        ".3");
    EXPECT_EQ(disney.type, "metallic_roughness");
    ExpectFloats(disney, "metallic", {0.7f});
    const Material layers = First(
        "Material \"disney\" \"rgb color\" [.4 .4 .4] \"float sheen\" .5 \"float clearcoat\" .4 "
        "\"float clearcoatgloss\" 0 \"float speculartint\" 1");
    ExpectFloats(layers, "sheen_color", {0.5f, 0.5f, 0.5f});
    ExpectFloats(layers, "clearcoat", {0.1f});
    EXPECT_NEAR(layers.params.GetFloat("clearcoat_roughness", 0), std::sqrt(0.1f), 1e-6f);
    ExpectFloats(layers, "specular_color", {1, 1, 1});
    const Scene scene = LoadMaterial("Material \"subsurface\" \"rgb reflectance\" [.1 .2 .3]");
    ExpectFloats(scene.materials[0], "base_color", {0.1f, 0.2f, 0.3f});
    EXPECT_THAT(Text(scene), HasSubstr("materials of type subsurface"));
}

TEST(PbrtMaterials, SpectraAreReduced) {
    ExpectFloats(First("Material \"diffuse\" \"spectrum reflectance\" [300 .4 800 .4]"),
                 "base_color", {0.4f, 0.4f, 0.4f});
    const std::vector<float> red =
        Floats(First("Material \"diffuse\" \"spectrum reflectance\" [400 0 599 0 600 1 800 1]"),
               "base_color");
    EXPECT_GT(red[0], 0.8f);
    EXPECT_LT(red[2], 0.05f);
    PbrtFiles files;
    files["k.spd"] = "# nm value\n400 3\n700 3\n";
    const Scene file = LoadMaterial("Material \"conductor\" \"spectrum k\" \"k.spd\"", files);
    ExpectFloats(file.materials[0], "k", {3, 3, 3});
    EXPECT_THAT(Text(file), HasSubstr("reduced to RGB"));
    EXPECT_THAT(
        MessageOf([] { LoadMaterial("Material \"conductor\" \"spectrum k\" \"metal-Xx-k\""); }),
        HasSubstr("neither a name that is known nor a file"));
    // Of 6500 K, near white; of 2000 K, orange; luminance 1 either way.
    const auto blackbody = [](const char* kelvin) {
        const Scene scene =
            LoadMaterial(std::string("AreaLightSource \"diffuse\" \"blackbody L\" ") + kelvin);
        const auto c =
            Floats(scene.materials[static_cast<std::size_t>(scene.meshes[0].material)], "emissive");
        return Rgb{c[0], c[1], c[2]};
    };
    const Rgb day = blackbody("6500"), candle = blackbody("2000");
    EXPECT_NEAR(Luminance(day), 1, 1e-3f);
    EXPECT_NEAR(day.x, day.z, 0.08f);
    EXPECT_NEAR(Luminance(candle), 1, 0.02f);  // blue below 0 is cut off
    EXPECT_GT(candle.x, 5 * candle.z);
}

}  // namespace
}  // namespace relume::test
