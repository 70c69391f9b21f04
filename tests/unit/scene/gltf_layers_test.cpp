#include "tests/unit/scene/gltf_file.h"

namespace relume::test {
namespace {

using nlohmann::json;
using testing::Contains;
using testing::ElementsAre;
using testing::HasSubstr;
using testing::IsEmpty;

using Floats = std::vector<float>;

// With texture i of the picture i.tga, for i < 8.
MapSource WithTextures(GltfFile file) {
    for (int i = 0; i < 8; ++i) {
        file.Add("textures", {{"source", i}});
        file.Add("images", {{"uri", std::to_string(i) + ".tga"}});
    }
    MapSource files = file.Files();
    for (int i = 0; i < 8; ++i) {
        files.files[std::to_string(i) + ".tga"] = TgaPicture(1 + i, 1, 10, 20, 30);
    }
    return files;
}

// The picture that a parameter's texture reads, and whether it is sRGB-encoded.
std::pair<std::string, bool> TextureOf(const Scene& scene, const char* param) {
    const int index = scene.materials.at(0).params.GetInt(param, -1);
    if (index < 0) {
        return {"none", false};
    }
    const Texture& texture = scene.textures.at(static_cast<std::size_t>(index));
    return {scene.images.at(static_cast<std::size_t>(texture.image)).name, texture.srgb};
}

using Picture = std::pair<std::string, bool>;

TEST(GltfLayers, Specular) {
    const Scene scene =
        Load(WithTextures(TexturedFile({{"extensions",
                                         {{"KHR_materials_specular",
                                           {{"specularFactor", 0.25},
                                            {"specularTexture", {{"index", 0}}},
                                            {"specularColorFactor", {1, 0.5, 2}},
                                            {"specularColorTexture", {{"index", 1}}}}}}}})));
    const ParamSet& params = scene.materials[0].params;
    EXPECT_EQ(params.GetFloat("specular", 1), 0.25f);
    EXPECT_EQ(params.GetFloats("specular_color", {}), (Floats{1, 0.5f, 2}));
    EXPECT_EQ(TextureOf(scene, "specular_texture"), Picture("0.tga", false));
    EXPECT_EQ(TextureOf(scene, "specular_color_texture"), Picture("1.tga", true));
    EXPECT_THAT(scene.notes, IsEmpty());
}

TEST(GltfLayers, Clearcoat) {
    json coat = {{"clearcoatFactor", 0.5},
                 {"clearcoatTexture", {{"index", 2}}},
                 {"clearcoatRoughnessFactor", 0.125},
                 {"clearcoatRoughnessTexture", {{"index", 3}}},
                 {"clearcoatNormalTexture", {{"index", 4}, {"scale", 2}}}};
    const auto load = [](const json& extension) {
        return Load(
            WithTextures(TexturedFile({{"extensions", {{"KHR_materials_clearcoat", extension}}}})));
    };
    const Scene scene = load(coat);
    const ParamSet& params = scene.materials[0].params;
    EXPECT_EQ(params.GetFloat("clearcoat", 0), 0.5f);
    EXPECT_EQ(params.GetFloat("clearcoat_roughness", 0), 0.125f);
    EXPECT_EQ(params.GetFloat("clearcoat_normal_scale", 1), 2);
    EXPECT_EQ(TextureOf(scene, "clearcoat_texture"), Picture("2.tga", false));
    EXPECT_EQ(TextureOf(scene, "clearcoat_roughness_texture"), Picture("3.tga", false));
    EXPECT_EQ(TextureOf(scene, "clearcoat_normal_texture"), Picture("4.tga", false));
    EXPECT_THAT(scene.notes, IsEmpty());

    // No coat: its pictures are not even read.
    coat["clearcoatFactor"] = 0;
    const Scene bare = load(coat);
    EXPECT_THAT(bare.images, IsEmpty());
    EXPECT_FALSE(bare.materials[0].params.Has("clearcoat_roughness"));
}

TEST(GltfLayers, Sheen) {
    const Scene scene =
        Load(WithTextures(TexturedFile({{"extensions",
                                         {{"KHR_materials_sheen",
                                           {{"sheenColorFactor", {0.5, 0.25, 0}},
                                            {"sheenColorTexture", {{"index", 5}}},
                                            {"sheenRoughnessFactor", 0.75},
                                            {"sheenRoughnessTexture", {{"index", 6}}}}}}}})));
    const ParamSet& params = scene.materials[0].params;
    EXPECT_EQ(params.GetFloats("sheen_color", {}), (Floats{0.5f, 0.25f, 0}));
    EXPECT_EQ(params.GetFloat("sheen_roughness", 0), 0.75f);
    EXPECT_EQ(TextureOf(scene, "sheen_color_texture"), Picture("5.tga", true));
    EXPECT_EQ(TextureOf(scene, "sheen_roughness_texture"), Picture("6.tga", false));
}

TEST(GltfLayers, UnlitShinesWithItsBaseColour) {
    json material = {
        {"extensions", {{"KHR_materials_unlit", json::object()}}},
        {"emissiveFactor", {9, 9, 9}},
        {"pbrMetallicRoughness",
         {{"baseColorFactor", {0.5, 0.25, 1, 0.5}}, {"baseColorTexture", {{"index", 7}}}}}};
    const Scene opaque = Load(WithTextures(TexturedFile(material)));
    const Material& m = opaque.materials[0];
    EXPECT_EQ(m.type, "diffuse");
    EXPECT_EQ(m.params.GetFloats("base_color", {}), (Floats{0, 0, 0}));
    EXPECT_EQ(m.params.GetFloats("emissive", {}), (Floats{0.5f, 0.25f, 1}));
    EXPECT_EQ(TextureOf(opaque, "emissive_texture"), Picture("7.tga", true));
    EXPECT_TRUE(m.params.GetBool("double_sided", false));
    EXPECT_FALSE(m.params.Has("base_color_texture"));
    EXPECT_FALSE(m.params.Has("alpha"));
    EXPECT_TRUE(opaque.HasLight());
    EXPECT_THAT(opaque.notes, IsEmpty());

    material["alphaMode"] = "BLEND";
    const Scene blend = Load(WithTextures(TexturedFile(material)));
    EXPECT_EQ(TextureOf(blend, "base_color_texture"), Picture("7.tga", true));
    EXPECT_EQ(blend.materials[0].params.GetFloat("alpha", 1), 0.5f);
    EXPECT_EQ(blend.materials[0].params.GetString("alpha_mode", ""), "blend");
}

TEST(GltfLayers, TexturesOfAnExtensionHaveTransforms) {
    const json texture = {
        {"index", 0},
        {"extensions", {{"KHR_texture_transform", {{"offset", {0.5, 0}}, {"scale", {2, 4}}}}}}};
    const Scene scene = Load(WithTextures(
        TexturedFile({{"extensions",
                       {{"KHR_materials_sheen",
                         {{"sheenColorFactor", {1, 1, 1}}, {"sheenColorTexture", texture}}}}}})));
    const float* m = scene.textures.at(0).uv_transform;
    EXPECT_THAT(Floats(m, m + 6), ElementsAre(2, 0, 0.5f, 0, 4, 0));
}

// One triangle whose TEXCOORD_1 is all 0.25.
GltfFile TwoSets(const json& material) {
    GltfFile file = TexturedFile(material);
    const int second = file.AddFloats({0.25f, 0.25f, 0.25f, 0.25f, 0.25f, 0.25f}, "VEC2");
    file.json["meshes"][0]["primitives"][0]["attributes"]["TEXCOORD_1"] = second;
    return file;
}

TEST(GltfLayers, ASecondSetOfTextureCoordinates) {
    const Scene own = Load(WithTextures(TwoSets(
        {{"pbrMetallicRoughness", {{"baseColorTexture", {{"index", 0}, {"texCoord", 1}}}}}})));
    ASSERT_EQ(own.meshes[0].uvs.size(), 3u);
    EXPECT_EQ(own.meshes[0].uvs[1].x, 0.25f);
    EXPECT_THAT(own.notes, IsEmpty());

    // KHR_texture_transform may name it, too.
    const json texture = {{"index", 0},
                          {"extensions", {{"KHR_texture_transform", {{"texCoord", 1}}}}}};
    const Scene named =
        Load(WithTextures(TwoSets({{"pbrMetallicRoughness", {{"baseColorTexture", texture}}}})));
    EXPECT_EQ(named.meshes[0].uvs[1].x, 0.25f);

    const Scene lacking = Load(
        WithTextures(TexturedFile({{"pbrMetallicRoughness", {{"baseColorTexture", texture}}}})));
    EXPECT_THAT(lacking.notes, Contains(HasSubstr("has no TEXCOORD_1")));
}

TEST(GltfLayers, TwoSetsInOneMaterialAreNoted) {
    const Scene scene = Load(
        WithTextures(TwoSets({{"name", "floor"},
                              {"normalTexture", {{"index", 1}, {"texCoord", 1}}},
                              {"pbrMetallicRoughness", {{"baseColorTexture", {{"index", 0}}}}}})));
    EXPECT_NE(scene.meshes[0].uvs.at(1).x, 0.25f);
    EXPECT_THAT(scene.notes,
                ElementsAre("scene.gltf: material 0 'floor': normal_texture uses TEXCOORD_1 but "
                            "base_color_texture uses TEXCOORD_0: the latter is taken for both"));
}

TEST(GltfLayers, AnExtensionThatIsNotSupportedIsNotedOnce) {
    GltfFile file =
        TexturedFile({{"extensions", {{"KHR_materials_iridescence", {{"iridescenceFactor", 1}}}}}});
    file.json["extensionsUsed"] = {"KHR_materials_iridescence", "KHR_materials_clearcoat"};
    EXPECT_THAT(Load(file).notes,
                ElementsAre("the extension KHR_materials_iridescence is not supported, and "
                            "ignored"));
}

}  // namespace
}  // namespace relume::test
