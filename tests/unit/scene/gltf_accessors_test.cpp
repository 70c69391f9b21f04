#include "tests/unit/scene/gltf_file.h"

namespace relume::test {
namespace {

using nlohmann::json;
using testing::AllOf;
using testing::HasSubstr;

const std::vector<float> kTriangle{0, 0, 0, 1, 0, 0, 0, 1, 0};

// Mesh 0 has these corners, in a node.
GltfFile FileOf(int positions_accessor, GltfFile file, int indices = -1, int mode = 4) {
    file.AddNode(
        {{"mesh", file.AddMesh({{"POSITION", positions_accessor}}, indices, {{"mode", mode}})}});
    return file;
}

TEST(GltfAccessors, StrideAndOffsetsAreObeyed) {
    GltfFile file;
    // Twenty bytes a vertex: position, then two floats that are not for us.
    std::vector<float> interleaved{99};
    for (int i = 0; i < 3; ++i) {
        const float x = static_cast<float>(i);
        interleaved.insert(interleaved.end(), {x, x * x, 5, 77, 88});
    }
    const int accessor = file.AddAccessor(Bytes(interleaved), kFloat, "VEC3", 3, false, 20);
    file.json["accessors"][accessor]["byteOffset"] = 4;
    const Scene scene = Load(FileOf(accessor, file));
    EXPECT_THAT(scene.meshes[0].positions,
                testing::ElementsAre(Vec3f{0, 0, 5}, Vec3f{1, 1, 5}, Vec3f{2, 4, 5}));
}

TEST(GltfAccessors, NormalisedIntegersOfEachKind) {
    const json material = {{"pbrMetallicRoughness", {{"baseColorTexture", {{"index", 0}}}}}};
    const auto uvs = [&](const std::string& bytes, int type) {
        GltfFile file = TexturedFile(material);
        file.Add("textures", {{"source", 0}});
        file.Add("images", {{"uri", "a.tga"}});
        file.json["meshes"][0]["primitives"][0]["attributes"]["TEXCOORD_0"] =
            file.AddAccessor(bytes, type, "VEC2", 3, true, 4);
        MapSource files = file.Files();
        files.files["a.tga"] = TgaPicture(1, 1, 0, 0, 0);
        std::vector<float> out;
        const Scene scene = Load(files);
        for (const Vec2f uv : scene.meshes.at(0).uvs) {
            out.push_back(uv.x);
            out.push_back(uv.y);
        }
        return out;
    };
    EXPECT_EQ(uvs(Bytes<std::uint8_t>({0, 255, 9, 9, 51, 0, 9, 9, 255, 255, 9, 9}), kUByte),
              (std::vector<float>{0, 1, 51 / 255.0f, 0, 1, 1}));
    EXPECT_EQ(uvs(Bytes<std::uint16_t>({0, 65535, 13107, 0, 65535, 65535}), kUShort),
              (std::vector<float>{0, 1, 13107 / 65535.0f, 0, 1, 1}));
    // Section 3.6.2.2: both -128 and -127 are -1.
    EXPECT_EQ(uvs(Bytes<std::int8_t>({-128, -127, 0, 0, 0, 127, 0, 0, 127, 127, 0, 0}), kByte),
              (std::vector<float>{-1, -1, 0, 1, 1, 1}));
    EXPECT_EQ(uvs(Bytes<std::int16_t>({-32768, 32767, 0, 0, 32767, 0}), kShort),
              (std::vector<float>{-1, 1, 0, 0, 1, 0}));
}

TEST(GltfAccessors, IntegersThatAreNotNormalisedKeepTheirValue) {
    GltfFile file;
    file.json["extensionsRequired"] = {"KHR_mesh_quantization"};
    const int accessor = file.AddAccessor(
        Bytes<std::int16_t>({0, 0, 0, 0, 300, 0, 0, 0, 0, -7, 0, 0}), kShort, "VEC3", 3, false, 8);
    EXPECT_EQ(Load(FileOf(accessor, file)).Bounds().upper, (Vec3f{300, 0, 0}));
    EXPECT_EQ(Load(FileOf(accessor, file)).Bounds().lower, (Vec3f{0, -7, 0}));
}

TEST(GltfAccessors, SparseOverwritesItsBase) {
    GltfFile file;
    const int accessor = file.AddFloats(kTriangle, "VEC3");
    const int where = file.AddView(Bytes<std::uint16_t>({2}));
    const int what = file.AddView(Bytes<float>({0, 8, 0}));
    file.json["accessors"][accessor]["sparse"] = {
        {"count", 1},
        {"indices", {{"bufferView", where}, {"componentType", kUShort}}},
        {"values", {{"bufferView", what}}}};
    EXPECT_EQ(Load(FileOf(accessor, file)).meshes[0].positions[2], (Vec3f{0, 8, 0}));
    EXPECT_EQ(Load(FileOf(accessor, file)).meshes[0].positions[1], (Vec3f{1, 0, 0}));
}

TEST(GltfAccessors, SparseWithoutABaseBeginsWithZeros) {
    GltfFile file;
    const int where = file.AddView(Bytes<std::uint8_t>({1, 2}));
    const int what = file.AddView(Bytes<float>({1, 0, 0, 0, 1, 0}));
    const int accessor =
        file.Add("accessors", {{"componentType", kFloat},
                               {"type", "VEC3"},
                               {"count", 3},
                               {"sparse",
                                {{"count", 2},
                                 {"indices", {{"bufferView", where}, {"componentType", kUByte}}},
                                 {"values", {{"bufferView", what}}}}}});
    EXPECT_THAT(Load(FileOf(accessor, file)).meshes[0].positions,
                testing::ElementsAre(Vec3f{0, 0, 0}, Vec3f{1, 0, 0}, Vec3f{0, 1, 0}));
}

TEST(GltfAccessors, SparseIndexOutOfRangeIsRefused) {
    GltfFile file;
    const int accessor = file.AddFloats(kTriangle, "VEC3");
    const int where = file.AddView(Bytes<std::uint16_t>({3}));
    const int what = file.AddView(Bytes<float>({0, 8, 0}));
    file.json["accessors"][accessor]["sparse"] = {
        {"count", 1},
        {"indices", {{"bufferView", where}, {"componentType", kUShort}}},
        {"values", {{"bufferView", what}}}};
    EXPECT_THAT(MessageOf([&] { Load(FileOf(accessor, file)); }),
                AllOf(HasSubstr("scene.gltf: mesh 0"), HasSubstr("sparse index 3 of 3")));
}

TEST(GltfAccessors, IndicesOfEachWidth) {
    const std::vector<float> quad{0, 0, 0, 1, 0, 0, 1, 1, 0, 0, 1, 0};
    const auto second = [&](const std::string& bytes, int type) {
        GltfFile file;
        const int positions = file.AddFloats(quad, "VEC3");
        const int indices = file.AddAccessor(bytes, type, "SCALAR", 6);
        const Scene scene = Load(FileOf(positions, file, indices));
        const Vec3u t = scene.meshes[0].triangles.at(1);
        return std::vector<std::uint32_t>{t.x, t.y, t.z};
    };
    const std::vector<std::uint32_t> expected{0, 2, 3};
    EXPECT_EQ(second(Bytes<std::uint8_t>({0, 1, 2, 0, 2, 3}), kUByte), expected);
    EXPECT_EQ(second(Bytes<std::uint16_t>({0, 1, 2, 0, 2, 3}), kUShort), expected);
    EXPECT_EQ(second(Bytes<std::uint32_t>({0, 1, 2, 0, 2, 3}), kUInt), expected);
}

TEST(GltfAccessors, EmbeddedBufferEqualsAFile) {
    GltfFile file = TriangleFile();
    MapSource files;
    json whole = file.json;
    whole["buffers"] =
        json::array({{{"uri", "data:application/octet-stream;base64," + Base64(file.buffer)},
                      {"byteLength", file.buffer.size()}}});
    files.files["scene.gltf"] = whole.dump();
    EXPECT_EQ(Load(files).meshes[0].positions, Load(file).meshes[0].positions);
    EXPECT_EQ(files.reads, (std::vector<std::string>{"scene.gltf"}));
    EXPECT_EQ(ListSceneFiles(files, "scene.gltf"), (std::vector<std::string>{"scene.gltf"}));
}

TEST(GltfAccessors, BinaryFileEqualsText) {
    const GltfFile file = TriangleFile();
    MapSource files;
    files.files["scene.glb"] = file.Binary();
    const Scene scene = LoadScene(files, "scene.glb", {});
    EXPECT_EQ(scene.meshes[0].positions, Load(file).meshes[0].positions);
    EXPECT_EQ(scene.name, "scene.glb");
    EXPECT_EQ(ListSceneFiles(files, "scene.glb"), (std::vector<std::string>{"scene.glb"}));
}

}  // namespace
}  // namespace relume::test
