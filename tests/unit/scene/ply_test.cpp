#include "core/scene/ply.h"

#include <algorithm>

#include "tests/unit/scene/pbrt_file.h"

namespace relume::test {
namespace {

using testing::HasSubstr;

// Two vertices' worth of properties and a quad, in either byte order.
std::string Binary(const std::string& format, std::uint32_t vertex_count, std::uint32_t face_count,
                   std::uint8_t corners, bool big) {
    std::string bytes =
        "ply\nformat " + format + " 1.0\ncomment made here\nelement vertex " +
        std::to_string(vertex_count) +
        "\nproperty float x\nproperty double y\nproperty float z\nproperty uchar "
        "red\nproperty float u\nproperty float v\nelement face " +
        std::to_string(face_count) +
        "\nproperty uchar skipped\nproperty list uchar int vertex_indices\nproperty "
        "int face_indices\nend_header\n";
    const auto add = [&](auto value) {
        std::string raw = Bytes(std::vector<decltype(value)>{value});
        if (big) {
            std::reverse(raw.begin(), raw.end());
        }
        bytes += raw;
    };
    for (int i = 0; i < 4; ++i) {
        add(static_cast<float>(i % 2));
        add(static_cast<double>(i / 2));
        add(3.0f);
        add(static_cast<std::uint8_t>(200));
        add(0.25f * static_cast<float>(i));
        add(0.5f);
    }
    add(static_cast<std::uint8_t>(7));
    add(corners);
    for (const std::int32_t index : {0, 1, 3, 2}) {
        add(index);
    }
    add(std::int32_t{9});
    return bytes;
}

void ExpectSquare(const PlyMesh& mesh) {
    ASSERT_EQ(mesh.positions.size(), 4u);
    EXPECT_EQ(mesh.positions[3], (Vec3f{1, 1, 3}));
    ASSERT_EQ(mesh.uvs.size(), 4u);
    EXPECT_EQ(mesh.uvs[3].x, 0.75f);
    EXPECT_TRUE(mesh.normals.empty());
    ASSERT_EQ(mesh.triangles.size(), 2u);
    EXPECT_EQ(mesh.triangles[1].x, 0u);
    EXPECT_EQ(mesh.triangles[1].y, 3u);
    EXPECT_EQ(mesh.triangles[1].z, 2u);
}

TEST(Ply, BothByteOrders) {
    ExpectSquare(ReadPly(Binary("binary_little_endian", 4, 1, 4, false), "m.ply"));
    ExpectSquare(ReadPly(Binary("binary_big_endian", 4, 1, 4, true), "m.ply"));
}

TEST(Ply, TextWithNormalsAndOtherNames) {
    const PlyMesh mesh = ReadPly(
        "ply\r\nformat ascii 1.0\r\nelement vertex 3\r\nproperty float x\r\nproperty float y\r\n"
        "property float z\r\nproperty float nx\r\nproperty float ny\r\nproperty float nz\r\n"
        "property float s\r\nproperty float t\r\nelement face 1\r\nproperty list uint8 uint "
        "vertex_index\r\nend_header\r\n0 0 0 0 0 1 .5 .25\r\n1 0 0 0 0 1 0 0\r\n0 1e0 -0 0 0 1 1 "
        "1\r\n"
        "3 0 1 2",
        "m.ply");
    EXPECT_EQ(mesh.triangles.size(), 1u);
    EXPECT_EQ(mesh.normals[0], (Vec3f{0, 0, 1}));
    EXPECT_EQ(mesh.uvs[0].y, 0.25f);
}

TEST(Ply, CorruptFilesAreTold) {
    const std::string good = Binary("binary_little_endian", 4, 1, 4, false);
    const auto message = [](const std::string& bytes) {
        return MessageOf([&] { ReadPly(bytes, "m.ply"); });
    };
    EXPECT_THAT(message(""), HasSubstr("m.ply"));
    EXPECT_THAT(message("\x1f\x8b zip\n"), HasSubstr("not a PLY file"));
    EXPECT_THAT(message("ply\nformat ascii 1.0\n"), HasSubstr("no end"));
    EXPECT_THAT(message("ply\nend_header\n"), HasSubstr("no format"));
    EXPECT_THAT(message("ply\nformat ascii 1.0\nelement vertex x\nend_header\n"),
                HasSubstr("m.ply:3: 'x' is not a count"));
    EXPECT_THAT(message("ply\nformat ascii 1.0\nelement vertex 1\nproperty half x\nend_header\n"),
                HasSubstr("'half' is not known"));
    EXPECT_THAT(message("ply\nformat ascii 1.0\nelement vertex 1\nproperty float "
                        "x\nproperty float y\nproperty float z\nend_header\n0 0 zero"),
                HasSubstr("is not a number"));
    // A count that the file can't hold is told before anything is allocated.
    EXPECT_THAT(message(Binary("binary_little_endian", 4000000000u, 1, 4, false)),
                HasSubstr("truncated"));
    EXPECT_THAT(message(Binary("binary_little_endian", 4, 4000000000u, 4, false)),
                HasSubstr("truncated"));
    EXPECT_THAT(message(Binary("binary_little_endian", 4, 1, 255, false)), HasSubstr("truncated"));
    for (std::size_t size = 0; size < good.size(); ++size) {
        EXPECT_THROW(ReadPly(good.substr(0, size), "m.ply"), Error) << size;
    }
}

TEST(Ply, IndicesOutOfRangeAreTold) {
    EXPECT_THAT(MessageOf([] {
                    ReadPly(
                        "ply\nformat ascii 1.0\nelement vertex 1\nproperty float x\nproperty float "
                        "y\nproperty float z\nelement face 1\nproperty list uchar int "
                        "vertex_indices\nend_header\n0 0 0\n3 0 0 1\n",
                        "m.ply");
                }),
                HasSubstr("vertex 1 of 1"));
}

}  // namespace
}  // namespace relume::test
