#pragma once

#include <string>
#include <string_view>
#include <vector>

#include "core/math/vec.h"
#include "core/scene/array_room.h"

namespace relume {

// What a renderer wants of a PLY file.
struct PlyMesh {
    std::vector<Vec3f> positions;
    std::vector<Vec3f> normals;    // empty or one a position; as in the file, of any length
    std::vector<Vec2f> uvs;        // empty or one a position
    std::vector<Vec3u> triangles;  // polygons are cut into fans; corners are in range
};

// Reads a PLY file, ASCII or binary of either byte order: element "vertex" with x y z, nx ny nz and
// u v (or s t, texture_u texture_v, texture_s texture_t), element "face" with the list
// vertex_indices or vertex_index. Other elements and properties are passed over. Counts are checked
// against the file's size before anything is allocated, and what is made of them by `room`, unless
// null. Throws naming `name` and the place.
PlyMesh ReadPly(std::string_view bytes, const std::string& name, ArrayRoom* room = nullptr);

}  // namespace relume
