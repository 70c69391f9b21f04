#include <cmath>

#include "tests/unit/scene/gltf_file.h"

namespace relume::test {
namespace {

using testing::AllOf;
using testing::ElementsAre;
using testing::HasSubstr;
using testing::IsEmpty;

using Floats = std::vector<float>;

MapSource Files(const std::string& material) {
    MapSource files;
    files.files["a.obj"] =
        "v 0 0 0\nv 1 0 0\nv 0 1 0\nvt 0 0\nmtllib a.mtl\nusemtl m\nf 1/1 2/1 3/1\n";
    files.files["a.mtl"] = "newmtl m\n" + material;
    files.files["a.tga"] = TgaPicture(2, 2, 10, 20, 30);
    files.files["b.tga"] = TgaPicture(1, 1, 40, 50, 60);
    files.files["n.tga"] = TgaPicture(1, 1, 128, 128, 255);
    return files;
}

Scene LoadWith(const std::string& material, bool decode = false) {
    return LoadScene(Files(material), "a.obj", {.decode_images = decode});
}

const Material& MaterialOf(const Scene& scene) {
    return scene.materials.at(static_cast<std::size_t>(scene.meshes.at(0).material));
}

const Texture& TextureOf(const Scene& scene, const char* param) {
    return scene.textures.at(static_cast<std::size_t>(MaterialOf(scene).params.GetInt(param, -1)));
}

std::string PictureOf(const Scene& scene, const char* param) {
    return scene.images.at(static_cast<std::size_t>(TextureOf(scene, param).image)).name;
}

TEST(ObjMaterials, Diffuse) {
    const Scene scene = LoadWith("Ka 1 1 1\nKd 0.5 0.25 1\nKs 0 0 0\nNs 10\nillum 2\n");
    const Material& m = MaterialOf(scene);
    EXPECT_EQ(m.name, "m");
    EXPECT_EQ(m.source, "a.mtl:1:1: material 'm'");
    EXPECT_EQ(m.type, "diffuse");
    EXPECT_EQ(m.params.GetFloats("base_color", {}), (Floats{0.5f, 0.25f, 1}));
    EXPECT_THAT(m.params.Unused(), IsEmpty());
    EXPECT_THAT(scene.notes, IsEmpty());
    EXPECT_EQ(MaterialOf(LoadWith("Kd 0.5\nKs 1 1 1\nillum 1\n")).type, "diffuse");
}

TEST(ObjMaterials, PhongHighlightsBecomeGgx) {
    const Scene scene = LoadWith("Kd 0.5\nKs 0.5 0.25 0\nNs 30\nmap_Kd a.tga\nmap_Ks b.tga\n");
    const Material& m = MaterialOf(scene);
    EXPECT_EQ(m.type, "metallic_roughness");
    EXPECT_EQ(m.params.GetFloat("metallic", 1), 0);
    // alpha 0.25 = sqrt(2 / (30 + 2)), and roughness is its root.
    EXPECT_FLOAT_EQ(m.params.GetFloat("roughness", 1), 0.5f);
    EXPECT_EQ(m.params.GetFloats("specular_color", {}), (Floats{1, 0.5f, 0}));
    EXPECT_EQ(PictureOf(scene, "base_color_texture"), "a.tga");
    EXPECT_TRUE(TextureOf(scene, "base_color_texture").srgb);
    EXPECT_EQ(PictureOf(scene, "specular_color_texture"), "b.tga");
}

TEST(ObjMaterials, PhysicallyBasedExtension) {
    const Scene scene = LoadWith(
        "Kd 0.5\nPr 0.25\nPm 0.75\nPs 0.5\nPc 0.5\nPcr 0.125\nmap_Pc a.tga\nmap_Pcr b.tga\n"
        "norm -bm 0.5 n.tga\n");
    const ParamSet& params = MaterialOf(scene).params;
    EXPECT_EQ(MaterialOf(scene).type, "metallic_roughness");
    EXPECT_EQ(params.GetFloat("roughness", 1), 0.25f);
    EXPECT_EQ(params.GetFloat("metallic", 0), 0.75f);
    EXPECT_EQ(params.GetFloats("sheen_color", {}), (Floats{0.5f, 0.5f, 0.5f}));
    EXPECT_EQ(params.GetFloat("clearcoat", 0), 0.5f);
    EXPECT_EQ(params.GetFloat("clearcoat_roughness", 0), 0.125f);
    EXPECT_EQ(PictureOf(scene, "clearcoat_texture"), "a.tga");
    EXPECT_EQ(PictureOf(scene, "clearcoat_roughness_texture"), "b.tga");
    EXPECT_EQ(PictureOf(scene, "normal_texture"), "n.tga");
    EXPECT_FALSE(TextureOf(scene, "normal_texture").srgb);
    EXPECT_EQ(params.GetFloat("normal_scale", 1), 0.5f);
    EXPECT_THAT(scene.notes, IsEmpty());
}

TEST(ObjMaterials, RoughnessAndMetalOfTwoPicturesGoIntoOne) {
    const Scene scene = LoadWith("Pr 1\nPm 1\nmap_Pr a.tga\nmap_Pm b.tga\n", true);
    const Texture& texture = TextureOf(scene, "metallic_roughness_texture");
    const SceneImage& image = scene.images.at(static_cast<std::size_t>(texture.image));
    EXPECT_EQ(image.name, "a.tga + b.tga");
    ASSERT_EQ(image.width, 2);
    ASSERT_EQ(image.bytes.size(), 12u);
    EXPECT_EQ(image.bytes[10], 20);  // G of a
    EXPECT_EQ(image.bytes[11], 60);  // B of b
    // What went into it alone is not kept.
    EXPECT_THAT(scene.images[0].bytes, IsEmpty());

    // One picture for both, and one of roughness where there is no metal, do as they are.
    EXPECT_EQ(PictureOf(LoadWith("Pm 1\nmap_Pr a.tga\nmap_Pm a.tga\n", true),
                        "metallic_roughness_texture"),
              "a.tga");
    EXPECT_EQ(PictureOf(LoadWith("Pr 1\nmap_Pr a.tga\n", true), "metallic_roughness_texture"),
              "a.tga");
    // Of metal alone: roughness must not be scaled by its picture.
    const Scene metal = LoadWith("Pr 0.5\nmap_Pm b.tga\n", true);
    const auto& bytes = scene.images.empty()
                            ? std::vector<std::uint8_t>()
                            : metal.images
                                  .at(static_cast<std::size_t>(
                                      TextureOf(metal, "metallic_roughness_texture").image))
                                  .bytes;
    EXPECT_THAT(bytes, ElementsAre(255, 255, 60));
}

TEST(ObjMaterials, GlassAndMirrors) {
    const Scene glass = LoadWith("Kd 0 0 0\nNi 1.25\nTf 0.5 1 1\nillum 7\nd 0.2\n");
    EXPECT_EQ(MaterialOf(glass).type, "dielectric");
    EXPECT_EQ(MaterialOf(glass).params.GetFloat("ior", 0), 1.25f);
    EXPECT_EQ(MaterialOf(glass).params.GetFloats("tint", {}), (Floats{0.5f, 1, 1}));
    EXPECT_FALSE(MaterialOf(glass).params.Has("alpha"));
    EXPECT_EQ(MaterialOf(LoadWith("Kd 1\nNi 1\nillum 4\nd 0.5\n")).type, "diffuse");

    const Scene mirror = LoadWith("Kd 0 0 0\nKs 0.5 0.5 1\nillum 3\n");
    EXPECT_EQ(MaterialOf(mirror).type, "conductor");
    EXPECT_EQ(MaterialOf(mirror).params.GetFloats("reflectance", {}), (Floats{0.5f, 0.5f, 1}));
    EXPECT_FALSE(MaterialOf(mirror).params.GetBool("fresnel", true));
    EXPECT_TRUE(MaterialOf(LoadWith("Kd 0\nKs 0.5\nillum 5\n")).params.GetBool("fresnel", false));

    // A quarter diffuse, three quarters mirrored, in sum what the file says.
    const Scene both = LoadWith("Kd 0.2 0.1 0\nKs 0.6 0.6 0.6\nillum 3\n");
    const Material& mix = MaterialOf(both);
    EXPECT_EQ(mix.type, "mix");
    EXPECT_FLOAT_EQ(mix.params.GetFloat("amount", 0), 0.75f);
    const auto part = [&](const char* name) -> const ParamSet& {
        return both.materials.at(static_cast<std::size_t>(mix.params.GetInt(name, -1))).params;
    };
    EXPECT_NEAR(part("material_a").GetFloats("base_color", {}).at(0) * 0.25f, 0.2f, 1e-6f);
    EXPECT_NEAR(part("material_b").GetFloats("reflectance", {}).at(0) * 0.75f, 0.6f, 1e-6f);
}

TEST(ObjMaterials, EmissionIsTwoSided) {
    const Scene scene = LoadWith("Ke 4 2 0\nmap_Ke a.tga\n");
    EXPECT_EQ(MaterialOf(scene).params.GetFloats("emissive", {}), (Floats{4, 2, 0}));
    EXPECT_EQ(PictureOf(scene, "emissive_texture"), "a.tga");
    EXPECT_TRUE(MaterialOf(scene).params.GetBool("double_sided", false));
    EXPECT_TRUE(scene.HasLight());
    EXPECT_FALSE(LoadWith("Ke 0 0 0\n").HasLight());
}

TEST(ObjMaterials, Alpha) {
    const auto alpha = [](const char* text) {
        return MaterialOf(LoadWith(text)).params.GetFloat("alpha", 1);
    };
    EXPECT_EQ(alpha("d 0.25\n"), 0.25f);
    EXPECT_EQ(alpha("Tr 0.25\n"), 0.75f);
    EXPECT_EQ(alpha("d 0.5\nTr 0.25\n"), 0.5f);
    EXPECT_EQ(alpha("Tr 0.25\nd 0.5\n"), 0.5f);
    EXPECT_EQ(MaterialOf(LoadWith("d 0.25\n")).params.GetString("alpha_mode", ""), "blend");
    const Scene picture = LoadWith("map_d a.tga\n");
    EXPECT_EQ(PictureOf(picture, "alpha_texture"), "a.tga");
    EXPECT_FALSE(TextureOf(picture, "alpha_texture").srgb);

    // A picture with an alpha channel means that.
    MapSource files = Files("map_d c.tga\n");
    std::string tga(18, '\0');
    tga[2] = 2;
    tga[12] = tga[14] = 1;
    tga[16] = 32;
    tga[17] = 8;
    files.files["c.tga"] = tga + std::string("\x1e\x14\x0a\x4d");  // b g r a
    const Scene matte = LoadScene(files, "a.obj", {});
    const SceneImage& image =
        matte.images.at(static_cast<std::size_t>(TextureOf(matte, "alpha_texture").image));
    EXPECT_EQ(image.channels, 1);
    EXPECT_THAT(image.bytes, ElementsAre(0x4d));
    // That of the base colour counts anyway: once is enough.
    files.files["a.mtl"] += "map_Kd c.tga\n";
    const Scene base = LoadScene(files, "a.obj", {});
    EXPECT_EQ(PictureOf(base, "base_color_texture"), "c.tga");
    EXPECT_EQ(base.images[0].channels, 4);
    EXPECT_FALSE(MaterialOf(base).params.Has("alpha_texture"));
    EXPECT_EQ(MaterialOf(base).params.GetString("alpha_mode", ""), "blend");
}

TEST(ObjMaterials, BumpsAreHeightsOrNormalsAsTheirPictureLooks) {
    const Scene bump = LoadWith("map_Bump -bm 0.25 a.tga\n", true);
    EXPECT_EQ(PictureOf(bump, "bump_texture"), "a.tga");
    EXPECT_EQ(MaterialOf(bump).params.GetFloat("bump_scale", 1), 0.25f);
    const Scene normals = LoadWith("bump -bm 0.25 n.tga\n", true);
    EXPECT_FALSE(MaterialOf(normals).params.Has("bump_texture"));
    EXPECT_EQ(PictureOf(normals, "normal_texture"), "n.tga");
    EXPECT_EQ(MaterialOf(normals).params.GetFloat("normal_scale", 1), 0.25f);
}

TEST(ObjMaterials, OptionsOfPictures) {
    const Scene scene = LoadWith("map_Kd -clamp on -s 2 4 1 -o 0.5 0.25 -mm 0 1 a.tga\n");
    const Texture& texture = TextureOf(scene, "base_color_texture");
    EXPECT_EQ(texture.wrap_u, WrapMode::kClamp);
    // v up is scaled and moved; here it runs down: 1 - (4 (1 - v) + 0.25).
    EXPECT_THAT(Floats(texture.uv_transform, texture.uv_transform + 6),
                ElementsAre(2, 0, 0.5f, 0, 4, -3.25f));
    EXPECT_THAT(scene.notes, ElementsAre("a.mtl:2: the option '-mm' of pictures is not "
                                         "supported, and ignored"));
}

TEST(ObjMaterials, WhatIsWrongOrUnknownNamesItsLine) {
    const auto problem = [](const std::string& text) { return MessageOf([&] { LoadWith(text); }); };
    EXPECT_THAT(problem("Kd 1 nan 1\n"), AllOf(HasSubstr("a.mtl:2:6"), HasSubstr("not finite")));
    EXPECT_THAT(problem("Kd 1 -1 1\n"), HasSubstr("a.mtl:2:4: 'Kd' can't be negative"));
    EXPECT_THAT(problem("Kd 1 1\n"), HasSubstr("'Kd' needs 3 numbers"));
    EXPECT_THAT(problem("Ns\n"), HasSubstr("'Ns' needs"));
    EXPECT_THAT(problem("map_Kd /elsewhere/a.png\n"), HasSubstr("a.mtl:2:1: the path"));
    MapSource files = Files("");
    files.files["a.mtl"] = "Kd 1 1 1\nnewmtl m\n";
    EXPECT_THAT(MessageOf([&] { LoadScene(files, "a.obj", {}); }),
                HasSubstr("a.mtl:1:1: 'Kd' stands before the first newmtl"));
    EXPECT_THAT(LoadWith("aniso 0.5\naniso 0.25\ndisp a.tga\nd -halo 0.5\nmap_Kd\n").notes,
                ElementsAre("a.mtl:2: 'aniso' of materials is not supported, and ignored",
                            "a.mtl:4: 'disp' of materials is not supported, and ignored",
                            "a.mtl:5: 'd -halo' is taken as plain 'd'",
                            "a.mtl:6: 'map_Kd' names no picture, and is ignored"));
}

}  // namespace
}  // namespace relume::test
