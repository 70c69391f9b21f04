#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <sys/resource.h>

#include <functional>
#include <string>

#include "core/base/error.h"
#include "core/base/resources.h"
#include "tests/unit/scene/gltf_file.h"

namespace relume {
namespace {

using test::GltfFile;
using testing::HasSubstr;
using testing::StartsWith;

long PeakKib() {
    rusage usage{};
    getrusage(RUSAGE_SELF, &usage);
    return usage.ru_maxrss;
}

// Loads what must not load, and without taking memory for what it says that it holds.
Error Fails(const std::map<std::string, std::string>& files, const std::string& main) {
    test::MapSource source;
    source.files = files;
    const long before = PeakKib();
    try {
        LoadScene(source, main, {});
    } catch (const Error& error) {
        EXPECT_LT(PeakKib() - before, 256 << 10) << error.what();
        return error;
    }
    ADD_FAILURE() << main << " loads";
    return {ErrorCode::kInternal, ""};
}

// A PNG of 16384 x 16384 pixels by its header, and nothing behind it.
std::string HugePng() {
    return std::string("\x89PNG\r\n\x1a\n\0\0\0\rIHDR\0\0\x40\0\0\0\x40\0\x08\x06\0\0\0", 29) +
           std::string("\xcd\x3c\x2e\xde\0\0\0\0IDAT\x35\xaf\x06\x1e\0\0\0\0IEND\xae\x42\x60\x82",
                       28);
}

TEST(HostileScene, CountsBeyondAllBuffersAreRefused) {
    for (const char* count : {"1099511627776", "9223372036854775807", "18446744073709551615", "-1",
                              "1e999", "1.5", "\"3\"", "4294967296"}) {
        const GltfFile file = test::TriangleFile();
        std::string text = file.Text();
        const std::size_t at = text.find("\"count\":");
        ASSERT_NE(at, std::string::npos) << text;
        const std::size_t end = text.find_first_of(",}", at);
        text.replace(at + 8, end - at - 8, count);
        SCOPED_TRACE(count);
        EXPECT_THAT(Fails({{"scene.gltf", text}, {"scene.bin", file.buffer}}, "scene.gltf").what(),
                    HasSubstr("scene.gltf"));
    }
}

TEST(HostileScene, AnArrayBeyondTheMachineIsRefusedBeforeItIsMade) {
    GltfFile file = test::TriangleFile();
    file.json["accessors"][0] = {
        {"componentType", test::kFloat},
        {"type", "VEC3"},
        {"count", std::uint64_t{1} << 50},
        {"sparse",
         {{"count", 1},
          {"indices", {{"bufferView", 0}, {"componentType", test::kUByte}}},
          {"values", {{"bufferView", 0}}}}}};
    const Error error = Fails(file.Files().files, "scene.gltf");
    EXPECT_EQ(error.code(), ErrorCode::kResourceExhausted) << error.what();
    EXPECT_THAT(error.what(), HasSubstr("half of the memory that this process may have"));
}

// `text`, as often as said.
std::string Times(int count, const std::string& text) {
    std::string all;
    for (int i = 0; i < count; ++i) {
        all += text;
    }
    return all;
}

// Small files whose arrays are large. `place`: what a refusal names.
struct LargeArrays {
    const char* what;
    std::string main, text, place;
    std::uint64_t too_few_bytes;
    std::map<std::string, std::string> more;
};

void RefusedWithoutRoom(const LargeArrays& c) {
    SCOPED_TRACE(c.what);
    test::MapSource source;
    source.files = c.more;
    source.files[c.main] = c.text;
    try {
        LoadScene(source, c.main, {.most_array_bytes = c.too_few_bytes});
        ADD_FAILURE() << "it loads";
    } catch (const Error& error) {
        EXPECT_EQ(error.code(), ErrorCode::kResourceExhausted) << error.what();
        EXPECT_THAT(error.what(), StartsWith(c.place));
        EXPECT_THAT(error.what(), HasSubstr("simplify the scene"));
    }
    EXPECT_NO_THROW(LoadScene(source, c.main, {}));
}

TEST(HostileScene, PbrtArraysAreCountedBeforeTheyAreMade) {
    const std::string world = "WorldBegin\n";
    const std::string triangle =
        "Shape \"trianglemesh\" \"integer indices\" [0 1 2] \"point P\" [0 0 0 1 0 0 0 1 0]\n";
    const std::string four = "\"point P\" [0 0 0 1 0 0 0 1 0 1 1 1]";
    std::string spheres;
    for (int i = 0; i < 30; ++i) {
        spheres += "Shape \"sphere\" \"float phimax\" " + std::to_string(359 - i) + "\n";
    }
    const std::string ply =
        "ply\nformat ascii 1.0\nelement vertex 3\nproperty float x\nproperty float y\n"
        "property float z\nelement face 1\nproperty list uint int vertex_indices\nend_header\n"
        "0 0 0\n1 0 0\n0 1 0\n90000" +
        Times(30'000, " 0 1 2");
    const LargeArrays cases[] = {
        {"numbers",
         "a.pbrt",
         world + "Shape \"trianglemesh\" \"integer indices\" [0 1 2] \"point P\" [" +
             Times(30'000, "0 0 0 1 0 0 0 1 0 ") + "]\n",
         "a.pbrt:2:",
         1 << 19,
         {}},
        {"patches",
         "a.pbrt",
         world + "Shape \"bilinearmesh\" " + four + " \"integer indices\" [" +
             Times(2'000, "0 1 2 3 ") + "]\n",
         "a.pbrt:2:1",
         1 << 21,
         {}},
        {"refinement",
         "a.pbrt",
         world + "Shape \"loopsubdiv\" \"integer levels\" 8 \"integer indices\" [0 1 2 0 3 1] " +
             four + "\n",
         "a.pbrt:2:1",
         1 << 20,
         {}},
        {"quadrics", "a.pbrt", world + spheres, "a.pbrt:", 1 << 22, {}},
        {"curves",
         "a.pbrt",
         world + "Shape \"curve\" \"string basis\" \"bspline\" \"point P\" [" +
             Times(500, "0 0 0 1 0 0 1 1 0 ") + "]\n",
         "a.pbrt:2:1",
         1 << 20,
         {}},
        {"instances",
         "a.pbrt",
         world + "ObjectBegin \"o\"\n" + Times(30, triangle) + "ObjectEnd\n" +
             Times(1'000, "ObjectInstance \"o\"\n"),
         "a.pbrt:",
         1 << 20,
         {}},
        {"moving instances",
         "a.pbrt",
         "Camera \"perspective\" \"float shutterclose\" 1\n" + world + "ObjectBegin \"o\"\n" +
             triangle + "ObjectEnd\nActiveTransform EndTime\n" +
             "Rotate 90 0 0 1\nActiveTransform All\n" + Times(1'000, "ObjectInstance \"o\"\n"),
         "a.pbrt:",
         1 << 19,
         {}},
        {"attributes",
         "a.pbrt",
         world + "Attribute \"shape\" \"float nothing\" [" + Times(10'000, "1 ") + "]\n" +
             Times(100, triangle),
         "a.pbrt:",
         1 << 20,
         {}},
        {"a mesh file",
         "a.pbrt",
         world + "Shape \"plymesh\" \"string filename\" \"m.ply\"\n",
         "a.pbrt:2:1: m.ply: face",
         1 << 19,
         {{"m.ply", ply}}},
    };
    for (const LargeArrays& c : cases) {
        RefusedWithoutRoom(c);
    }
}

TEST(HostileScene, ObjArraysAreCountedBeforeTheyAreMade) {
    const std::string vertices = "v 0 0 0\nv 1 0 0\nv 0 1 0\nvn 0 0 1\n";
    const LargeArrays cases[] = {
        {"corners",
         "a.obj",
         vertices + "f" + Times(30'000, " 1 2 3") + "\n",
         "a.obj:5:1",
         1 << 19,
         {}},
        {"vertices",
         "a.obj",
         Times(100'000, "v 1 2 3\n") + "v 0 0 0\nv 1 0 0\nf 1 -2 -1\n",
         "a.obj:",
         1 << 19,
         {}},
        {"parts",
         "a.obj",
         vertices + Times(5'000, "g a\nf 1 2 3\ng b\nf 1 2 3\n"),
         "a.obj:",
         1 << 19,
         {}},
        // Each face has vertices of its own, for its own normal; the file itself has room.
        {"vertices of faces",
         "a.obj",
         vertices + "f 1//1 2//1 3//1\n" + Times(20'000, "f 1 2 3\n"),
         "a.obj:5:1",
         5 << 19,
         {}},
        {"smoothing groups",
         "a.obj",
         Times(10'000, "v 0 0 0\nv 1 0 0\nv 0 1 0\ns 1\nf -3 -2 -1\n"),
         "a.obj:",
         5 << 19,
         {}},
    };
    for (const LargeArrays& c : cases) {
        RefusedWithoutRoom(c);
    }
}

TEST(HostileScene, PicturesThatAreLargerThanTheMachineTogetherAreNotDecoded) {
    GltfFile file = test::TexturedFile(nlohmann::json::object());
    std::map<std::string, std::string> pictures;
    const std::uint64_t count = AvailableResources().memory / 2 / (std::uint64_t{1} << 30) + 2;
    ASSERT_LT(count, 10'000u);
    for (std::uint64_t i = 0; i < count; ++i) {
        const std::string name = "huge" + std::to_string(i) + ".png";
        file.json["images"].push_back({{"uri", name}});
        file.json["textures"].push_back({{"source", i}});
        file.json["materials"].push_back(
            {{"pbrMetallicRoughness", {{"baseColorTexture", {{"index", i}}}}}});
        pictures[name] = HugePng();
    }
    auto& primitives = file.json["meshes"][0]["primitives"];
    const auto primitive = primitives[0];
    primitives.clear();
    const std::size_t first = file.json["materials"].size() - count;
    for (std::uint64_t i = 0; i < count; ++i) {
        primitives.push_back(primitive);
        primitives.back()["material"] = first + i;
    }
    std::map<std::string, std::string> files = file.Files().files;
    files.merge(pictures);
    const Error error = Fails(files, "scene.gltf");
    EXPECT_EQ(error.code(), ErrorCode::kResourceExhausted) << error.what();
    EXPECT_THAT(error.what(), HasSubstr("pictures take more than"));
}

TEST(HostileScene, DeepNestingAndNumbersBeyondAllRangesAreRefused) {
    const std::string deep(1'000'000, '[');
    EXPECT_THAT(Fails({{"scene.gltf", deep}}, "scene.gltf").what(), HasSubstr("nested deeper"));
    std::string objects;
    for (int i = 0; i < 100'000; ++i) {
        objects += "{\"a\":";
    }
    EXPECT_THAT(Fails({{"scene.gltf", objects}}, "scene.gltf").what(), HasSubstr("nested deeper"));
    std::string blocks;
    for (int i = 0; i < 100'000; ++i) {
        blocks += "AttributeBegin\n";
    }
    Fails({{"scene.pbrt", "WorldBegin\n" + blocks}}, "scene.pbrt");
    Fails({{"scene.pbrt", "WorldBegin\nTranslate 1e999 0 0\nShape \"sphere\"\n"}}, "scene.pbrt");
    Fails({{"scene.obj", "v 1e999 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n"}}, "scene.obj");
    Fails({{"scene.obj", "v 0 0 0\nf 1 4000000000 99999999999999999999\n"}}, "scene.obj");
}

TEST(HostileScene, PlyCountsBeyondTheFileAreRefused) {
    for (const char* count : {"1099511627776", "4294967295", "99999999999999999999"}) {
        const std::string ply =
            std::string("ply\nformat binary_little_endian 1.0\nelement vertex ") + count +
            "\nproperty float x\nproperty float y\nproperty float z\n"
            "element face " +
            count + "\nproperty list uchar int vertex_indices\nend_header\n";
        SCOPED_TRACE(count);
        Fails({{"scene.pbrt", "WorldBegin\nShape \"plymesh\" \"string filename\" \"mesh.ply\"\n"},
               {"mesh.ply", ply}},
              "scene.pbrt");
    }
}

}  // namespace
}  // namespace relume
