#include "tests/unit/scene/gltf_file.h"

namespace relume::test {
namespace {

using nlohmann::json;
using testing::AllOf;
using testing::HasSubstr;

std::string MessageOfText(const std::string& text) {
    MapSource files = TriangleFile().Files();
    files.files["scene.gltf"] = text;
    return MessageOf([&] { Load(files); });
}

std::string MessageOfBinary(const std::string& bytes) {
    MapSource files;
    files.files["scene.glb"] = bytes;
    return MessageOf([&] { LoadScene(files, "scene.glb", {}); });
}

TEST(GltfErrors, MissingFilesAreNamed) {
    MapSource files = TriangleFile().Files();
    files.files.erase("scene.bin");
    EXPECT_THAT(MessageOf([&] { Load(files); }),
                AllOf(HasSubstr("scene.gltf: buffer 0"), HasSubstr("scene.bin: missing")));
    files.files.erase("scene.gltf");
    EXPECT_THAT(MessageOf([&] { Load(files); }), HasSubstr("scene.gltf: missing"));
    EXPECT_THAT(MessageOf([&] { ListSceneFiles(files, "scene.gltf"); }),
                HasSubstr("scene.gltf: missing"));
}

TEST(GltfErrors, UnknownFormatListsTheKnownOnes) {
    EXPECT_THAT(MessageOf([] { LoadScene(MapSource(), "scene.xyz", {}); }),
                AllOf(HasSubstr("scene.xyz"), HasSubstr(".gltf .glb")));
    EXPECT_THAT(MessageOf([] { LoadScene(MapSource(), "scene", {}); }), HasSubstr(".gltf .glb"));
    MapSource upper;
    upper.files["SCENE.GLB"] = TriangleFile().Binary();
    EXPECT_EQ(LoadScene(upper, "SCENE.GLB", {}).TriangleCount(), 1u);
}

TEST(GltfErrors, MalformedJsonSaysLineAndColumn) {
    EXPECT_THAT(MessageOfText("{\n  \"asset\": {,}\n}"),
                AllOf(HasSubstr("scene.gltf: not whole JSON"), HasSubstr("line 2, column 13"),
                      HasSubstr("restore the file")));
    const std::string whole = TriangleFile().Text();
    EXPECT_THAT(MessageOfText(whole.substr(0, whole.size() / 2)),
                AllOf(HasSubstr("scene.gltf: not whole JSON"), HasSubstr("line ")));
    EXPECT_THAT(MessageOfText(""), HasSubstr("scene.gltf: not whole JSON"));
    EXPECT_THAT(MessageOfText("[1, 2]"), HasSubstr("not glTF"));
    EXPECT_THAT(MessageOfText(std::string(100000, '[')), HasSubstr("nested deeper"));
}

TEST(GltfErrors, BracketsInNamesAreNoDepth) {
    GltfFile file = TriangleFile();
    file.json["meshes"][0]["name"] = "\"\\" + std::string(1000, '[') + "\\";
    EXPECT_EQ(Load(file).TriangleCount(), 1u);
}

TEST(GltfErrors, MessagesAreOneLineAndShort) {
    const std::string message =
        MessageOfText("{\"asset\": \"data:" + std::string(100000, 'x') + "\n");
    EXPECT_EQ(message.find('\n'), std::string::npos);
    EXPECT_LT(message.size(), 400u);
}

TEST(GltfErrors, WrongVersionsAreRefused) {
    GltfFile file = TriangleFile();
    file.json["asset"]["version"] = "1.0";
    EXPECT_THAT(MessageOfText(file.Text()), HasSubstr("scene.gltf: glTF version 1.0"));
    file.json.erase("asset");
    EXPECT_THAT(MessageOfText(file.Text()), HasSubstr("scene.gltf: has no asset.version"));
    std::string binary = TriangleFile().Binary();
    binary[4] = 1;
    EXPECT_THAT(MessageOfBinary(binary), HasSubstr("scene.glb: binary glTF version 1"));
}

TEST(GltfErrors, RequiredExtensionsMustBeKnown) {
    GltfFile file = TriangleFile();
    file.json["extensionsRequired"] = {"KHR_draco_mesh_compression"};
    EXPECT_THAT(MessageOfText(file.Text()),
                AllOf(HasSubstr("scene.gltf: needs the extension KHR_draco_mesh_compression"),
                      HasSubstr("without it")));
}

TEST(GltfErrors, WrongTypesAreErrorsAndNotCrashes) {
    const auto message = [](const char* pointer, const json& value) {
        GltfFile file = TriangleFile();
        json whole = json::parse(file.Text());
        whole[json::json_pointer(pointer)] = value;
        return MessageOfText(whole.dump());
    };
    for (const char* pointer :
         {"/asset", "/asset/version", "/buffers", "/buffers/0", "/buffers/0/uri",
          "/buffers/0/byteLength", "/bufferViews/0/buffer", "/bufferViews/0/byteLength",
          "/accessors/0/bufferView", "/accessors/0/count", "/accessors/0/type",
          "/meshes/0/primitives/0/attributes", "/images", "/scenes/0/nodes"}) {
        for (const json& value : {json("text"), json(-7), json(1.5e300), json::array({"a"}),
                                  json::object({{"a", 1}}), json(nullptr)}) {
            MapSource files = TriangleFile().Files();
            json whole = json::parse(files.files["scene.gltf"]);
            whole[json::json_pointer(pointer)] = value;
            files.files["scene.gltf"] = whole.dump();
            try {
                Load(files);  // some are tolerable, e.g. no pictures
            } catch (const Error& error) {
                EXPECT_THAT(error.what(), HasSubstr("scene.gltf")) << pointer << " " << value;
            }
        }
    }
    EXPECT_THAT(message("/buffers/0/byteLength", "many"), HasSubstr("malformed glTF"));
    EXPECT_THAT(message("/bufferViews/0/buffer", 4), HasSubstr("buffer 4 does not exist"));
    EXPECT_THAT(message("/bufferViews/0/byteLength", 1000), HasSubstr("buffer view 0 ends at"));
    EXPECT_THAT(message("/accessors/0/bufferView", 3), HasSubstr("buffer view 3 does not exist"));
    EXPECT_THAT(message("/accessors/0/count", 1'000'000'000), HasSubstr("do not fit"));
    EXPECT_THAT(message("/scene", 2), HasSubstr("scene.gltf: scene 2 does not exist"));
}

TEST(GltfErrors, TruncatedBuffersAreNamed) {
    MapSource files = TriangleFile().Files();
    files.files["scene.bin"].resize(30);
    EXPECT_THAT(MessageOf([&] { Load(files); }),
                AllOf(HasSubstr("scene.gltf: buffer 0: scene.bin is truncated"),
                      HasSubstr("30 bytes"), HasSubstr("36"), HasSubstr("restore")));
}

TEST(GltfErrors, EveryPrefixOfABinaryFileIsRefused) {
    const std::string whole = TriangleFile().Binary();
    for (std::size_t size = 0; size < whole.size(); ++size) {
        const std::string message = MessageOfBinary(whole.substr(0, size));
        EXPECT_THAT(message, HasSubstr("scene.glb: ")) << size;
        if (size >= 4) {
            EXPECT_THAT(message, HasSubstr("truncated")) << size;
        }
    }
}

TEST(GltfErrors, BinaryWithWrongChunks) {
    std::string binary = TriangleFile().Binary();
    binary[12] = '\x7f';
    binary[13] = '\x7f';
    EXPECT_THAT(MessageOfBinary(binary), HasSubstr("scene.glb: byte 12: chunk 0 is longer"));
    binary = TriangleFile().Binary();
    binary[16] = 'X';
    EXPECT_THAT(MessageOfBinary(binary), HasSubstr("first chunk is not JSON"));
}

TEST(GltfErrors, NamesThatLeaveTheFolderAreRefused) {
    const auto message = [](const char* uri) {
        GltfFile file = TriangleFile();
        json whole = json::parse(file.Text());
        whole["buffers"][0]["uri"] = uri;
        return MessageOfText(whole.dump());
    };
    for (const char* uri : {"../scene.bin", "/etc/passwd", "a/../../b", "%2e%2e/b", "..\\b"}) {
        EXPECT_THAT(message(uri), AllOf(HasSubstr("scene.gltf: buffer 0"), HasSubstr("below")));
    }
    EXPECT_THAT(message("https://example.org/a.bin"), HasSubstr("not a file of the scene"));
    EXPECT_THAT(message("data:application/octet-stream;base64,!!!"), HasSubstr("not base64"));
}

TEST(GltfErrors, NothingToSeeIsAnError) {
    GltfFile file = TriangleFile();
    file.json["nodes"][0].erase("mesh");
    EXPECT_THAT(MessageOfText(file.Text()), HasSubstr("scene.gltf: the scene has no triangles"));
    file = TriangleFile();
    file.json["nodes"][0]["scale"] = {1e30, 1e30, 1};
    EXPECT_THAT(MessageOfText(file.Text()), HasSubstr("scene.gltf"));
}

}  // namespace
}  // namespace relume::test
