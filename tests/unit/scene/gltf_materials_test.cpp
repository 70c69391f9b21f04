#include <cmath>

#include "tests/unit/scene/gltf_file.h"

namespace relume::test {
namespace {

using nlohmann::json;
using testing::AllOf;
using testing::Contains;
using testing::HasSubstr;
using testing::IsEmpty;

using Floats = std::vector<float>;

// With textures 0 and 1, of a.tga (3x2) and b.tga (1x1).
MapSource WithPictures(GltfFile file) {
    file.Add("textures", {{"source", 0}});
    file.Add("textures", {{"source", 1}, {"sampler", 0}});
    file.Add("samplers", {{"wrapS", 33071}, {"wrapT", 33648}, {"magFilter", 9728}});
    file.Add("images", {{"uri", "a.tga"}});
    file.Add("images", {{"uri", "maps/b%20c.tga"}});
    MapSource files = file.Files();
    files.files["a.tga"] = TgaPicture(3, 2, 10, 20, 30);
    files.files["maps/b c.tga"] = TgaPicture(1, 1, 128, 128, 255);
    return files;
}

TEST(GltfMaterials, MissingMaterialIsTheFormatsDefault) {
    const Scene scene = Load(TriangleFile());
    ASSERT_EQ(scene.materials.size(), 1u);
    EXPECT_EQ(scene.materials[0].type, "metallic_roughness");
    EXPECT_THAT(scene.materials[0].params.values(), IsEmpty());
    EXPECT_THAT(scene.notes, IsEmpty());
    EXPECT_FALSE(scene.HasLight());
}

TEST(GltfMaterials, CoreParameters) {
    const Scene scene = Load(TexturedFile({{"name", "bricks"},
                                           {"doubleSided", true},
                                           {"alphaMode", "MASK"},
                                           {"alphaCutoff", 0.25},
                                           {"pbrMetallicRoughness",
                                            {{"baseColorFactor", {0.5, 0.25, 1, 0.75}},
                                             {"metallicFactor", 0.5},
                                             {"roughnessFactor", 0.125}}}}));
    const Material& m = scene.materials.at(0);
    EXPECT_EQ(m.name, "bricks");
    EXPECT_EQ(m.source, "scene.gltf: material 0 'bricks'");
    EXPECT_EQ(m.params.GetFloats("base_color", {}), (Floats{0.5f, 0.25f, 1}));
    EXPECT_EQ(m.params.GetFloat("base_alpha", 1), 0.75f);
    EXPECT_EQ(m.params.GetFloat("metallic", 1), 0.5f);
    EXPECT_EQ(m.params.GetFloat("roughness", 1), 0.125f);
    EXPECT_EQ(m.params.GetString("alpha_mode", "opaque"), "mask");
    EXPECT_EQ(m.params.GetFloat("alpha_cutoff", 0.5f), 0.25f);
    EXPECT_TRUE(m.params.GetBool("double_sided", false));
    EXPECT_THAT(m.params.Unused(), IsEmpty());
}

TEST(GltfMaterials, EmissionIsScaledByItsStrength) {
    const Scene scene = Load(TexturedFile(
        {{"emissiveFactor", {1, 0.5, 0}},
         {"extensions", {{"KHR_materials_emissive_strength", {{"emissiveStrength", 8}}}}}}));
    EXPECT_EQ(scene.materials[0].params.GetFloats("emissive", {}), (Floats{8, 4, 0}));
    EXPECT_TRUE(scene.HasLight());
}

TEST(GltfMaterials, TransmissionIorAndVolume) {
    const json extensions = {{"KHR_materials_transmission", {{"transmissionFactor", 0.75}}},
                             {"KHR_materials_ior", {{"ior", 1.25}}}};
    const Scene thin = Load(TexturedFile({{"extensions", extensions}}));
    EXPECT_EQ(thin.materials[0].params.GetFloat("transmission", 0), 0.75f);
    EXPECT_EQ(thin.materials[0].params.GetFloat("ior", 1.5f), 1.25f);
    EXPECT_TRUE(thin.materials[0].params.GetBool("thin", true));

    json solid = extensions;
    solid["KHR_materials_volume"] = {
        {"thicknessFactor", 0.1}, {"attenuationDistance", 2}, {"attenuationColor", {1, 0.5, 0}}};
    const Scene glass = Load(TexturedFile({{"extensions", solid}}));
    EXPECT_FALSE(glass.materials[0].params.GetBool("thin", true));
    // After 2 units half of the green is left.
    const Floats absorption = glass.materials[0].params.GetFloats("absorption", {});
    ASSERT_EQ(absorption.size(), 3u);
    EXPECT_EQ(absorption[0], 0);
    EXPECT_NEAR(absorption[1], std::log(2.0f) / 2, 1e-6f);
    EXPECT_GT(absorption[2], 5);
    EXPECT_TRUE(std::isfinite(absorption[2]));
    EXPECT_THAT(glass.notes, IsEmpty());

    // Without a distance it is clear.
    solid["KHR_materials_volume"].erase("attenuationDistance");
    const Scene clear = Load(TexturedFile({{"extensions", solid}}));
    EXPECT_FALSE(clear.materials[0].params.Has("absorption"));
}

TEST(GltfMaterials, TexturesKnowTheirEncodingAndSampler) {
    const Scene scene = Load(WithPictures(
        TexturedFile({{"normalTexture", {{"index", 1}, {"scale", 0.5}}},
                      {"pbrMetallicRoughness", {{"baseColorTexture", {{"index", 0}}}}}})));
    const ParamSet& params = scene.materials[0].params;
    const Texture& color =
        scene.textures.at(static_cast<std::size_t>(params.GetInt("base_color_texture", -1)));
    const Texture& normal =
        scene.textures.at(static_cast<std::size_t>(params.GetInt("normal_texture", -1)));
    EXPECT_TRUE(color.srgb);
    EXPECT_FALSE(color.nearest);
    EXPECT_EQ(color.wrap_u, WrapMode::kRepeat);
    EXPECT_FALSE(normal.srgb);
    EXPECT_TRUE(normal.nearest);
    EXPECT_EQ(normal.wrap_u, WrapMode::kClamp);
    EXPECT_EQ(normal.wrap_v, WrapMode::kMirror);
    EXPECT_EQ(params.GetFloat("normal_scale", 1), 0.5f);
    const SceneImage& image = scene.images.at(static_cast<std::size_t>(color.image));
    EXPECT_EQ(image.name, "a.tga");
    EXPECT_EQ(image.width, 3);
    EXPECT_EQ(image.height, 2);
    EXPECT_THAT(image.bytes, IsEmpty());  // not decoded
    EXPECT_EQ(scene.images.at(static_cast<std::size_t>(normal.image)).name, "maps/b c.tga");
}

TEST(GltfMaterials, PicturesAreDecodedWhenAsked) {
    const MapSource files = WithPictures(
        TexturedFile({{"pbrMetallicRoughness", {{"baseColorTexture", {{"index", 0}}}}}}));
    const Scene scene = LoadScene(files, "scene.gltf", {});
    ASSERT_EQ(scene.images.size(), 1u);  // b is not used
    EXPECT_EQ(scene.images[0].channels, 3);
    ASSERT_EQ(scene.images[0].bytes.size(), 18u);
    EXPECT_EQ(scene.images[0].bytes[0], 10);
    EXPECT_EQ(scene.images[0].bytes[2], 30);
}

TEST(GltfMaterials, APictureUsedTwiceIsReadOnce) {
    const json both = {{"normalTexture", {{"index", 0}}},
                       {"pbrMetallicRoughness", {{"baseColorTexture", {{"index", 0}}}}}};
    const MapSource files = WithPictures(TexturedFile(both));
    const Scene scene = Load(files);
    EXPECT_EQ(scene.images.size(), 1u);
    EXPECT_EQ(scene.textures.size(), 2u);  // colours and data
    EXPECT_EQ(std::count(files.reads.begin(), files.reads.end(), "a.tga"), 1);
}

TEST(GltfMaterials, TextureTransformScalesThenRotatesThenMoves) {
    const json texture = {{"index", 0},
                          {"extensions",
                           {{"KHR_texture_transform",
                             {{"offset", {0.5, 0.25}},
                              {"rotation", std::acos(0.0)},  // a quarter turn
                              {"scale", {2, 3}}}}}}};
    const Scene scene = Load(
        WithPictures(TexturedFile({{"pbrMetallicRoughness", {{"baseColorTexture", texture}}}})));
    const float* m = scene.textures.at(0).uv_transform;
    // KHR_texture_transform's matrices translation * rotation * scale: (u, v) to (3v, -2u) +
    // offset.
    const float expected[6] = {0, 3, 0.5f, -2, 0, 0.25f};
    for (int i = 0; i < 6; ++i) {
        EXPECT_NEAR(m[i], expected[i], 1e-6f) << i;
    }
}

TEST(GltfMaterials, EmbeddedPictures) {
    const std::string picture = TgaPicture(5, 4, 1, 2, 3);
    GltfFile file =
        TexturedFile({{"normalTexture", {{"index", 1}}},
                      {"pbrMetallicRoughness", {{"baseColorTexture", {{"index", 0}}}}}});
    file.Add("textures", {{"source", 0}});
    file.Add("textures", {{"source", 1}});
    const int view = file.AddView(picture);
    file.Add("images", {{"bufferView", view}, {"mimeType", "image/png"}});
    file.Add("images", {{"uri", "data:image/x-tga;base64," + Base64(picture)}});
    const MapSource files = file.Files();
    const Scene scene = LoadScene(files, "scene.gltf", {});
    ASSERT_EQ(scene.images.size(), 2u);
    for (const SceneImage& image : scene.images) {
        EXPECT_EQ(image.width, 5);
        EXPECT_EQ(image.bytes.size(), 60u);
    }
    EXPECT_EQ(ListSceneFiles(files, "scene.gltf"),
              (std::vector<std::string>{"scene.gltf", "scene.bin"}));
}

TEST(GltfMaterials, FilesAreListedInTheirOrderAndOnceEach) {
    const MapSource files = WithPictures(TexturedFile(
        {{"normalTexture", {{"index", 0}}},
         {"occlusionTexture", {{"index", 1}}},
         {"pbrMetallicRoughness",
          {{"baseColorTexture", {{"index", 1}}}, {"metallicRoughnessTexture", {{"index", 0}}}}}}));
    const auto names = ListSceneFiles(files, "scene.gltf");
    EXPECT_EQ(names,
              (std::vector<std::string>{"scene.gltf", "scene.bin", "a.tga", "maps/b c.tga"}));
    files.reads.clear();
    Load(files);
    EXPECT_THAT(files.reads, testing::UnorderedElementsAreArray(names));
}

TEST(GltfMaterials, MissingPictureNamesFileMaterialAndPicture) {
    MapSource files = WithPictures(TexturedFile(
        {{"name", "wall"}, {"pbrMetallicRoughness", {{"baseColorTexture", {{"index", 0}}}}}}));
    files.files.erase("a.tga");
    EXPECT_THAT(MessageOf([&] { Load(files); }),
                AllOf(HasSubstr("scene.gltf: material 0 'wall': base_color_texture"),
                      HasSubstr("image 0"), HasSubstr("a.tga: missing")));
}

TEST(GltfMaterials, WhatIsNoPictureIsRefused) {
    MapSource files = WithPictures(
        TexturedFile({{"pbrMetallicRoughness", {{"baseColorTexture", {{"index", 0}}}}}}));
    files.files["a.tga"] = "hello";
    EXPECT_THAT(MessageOf([&] { Load(files); }),
                AllOf(HasSubstr("material 0"), HasSubstr("a.tga"), HasSubstr("convert it")));
}

TEST(GltfMaterials, WrongReferencesNameWhoMakesThem) {
    const auto message = [](const json& material) {
        return MessageOf([&] { Load(WithPictures(TexturedFile(material))); });
    };
    EXPECT_THAT(message({{"normalTexture", {{"index", 5}}}}),
                HasSubstr("scene.gltf: material 0: normal_texture: texture 5 does not exist"));
    EXPECT_THAT(message({{"name", "x"}, {"alphaMode", "SOFT"}}),
                HasSubstr("scene.gltf: material 0 'x': alphaMode 'SOFT'"));
    GltfFile file = TriangleFile();
    file.json["meshes"][0]["primitives"][0]["material"] = 3;
    EXPECT_THAT(MessageOf([&] { Load(file); }),
                HasSubstr("scene.gltf: mesh 0: material 3 does not exist"));
    file = TexturedFile({{"normalTexture", {{"index", 0}}}});
    file.Add("textures", {{"source", 4}});
    EXPECT_THAT(MessageOf([&] { Load(file); }), HasSubstr("image 4 does not exist"));
}

}  // namespace
}  // namespace relume::test
