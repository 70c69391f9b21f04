#pragma once

#include <string>
#include <string_view>
#include <vector>

namespace relume::test {

// The kinds of input that come from elsewhere: "pbrt", "gltf", "glb", "obj", "ply", "image",
// "texts" (manifest paths and URIs), "tza" (weights of networks), and messages
// (read_messages.h).
const std::vector<std::string>& InputKinds();

// Gives the bytes to all that reads such input. What is wrong with them must end in a
// relume::Error, which is swallowed; any other exception gets through, and so does a broken promise
// (std::logic_error).
//
// A scene may have further files in the same bytes, each after a line "%%FILE": the first file that
// the loader asks for is the first of these, and so on. When they run out, it gets small sound
// files of its name's kind.
void ReadInput(const std::string& kind, std::string_view bytes);

}  // namespace relume::test
