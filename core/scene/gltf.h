#pragma once

#include <fmt/format.h>
#include <tiny_gltf.h>

#include <cstdint>
#include <map>
#include <memory>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "core/scene/array_room.h"
#include "core/scene/formats.h"
#include "core/scene/motion.h"
#include "core/scene/scene.h"

// The parts of the glTF 2.0 loader (load_gltf.cpp); nothing else includes this. "Section" in
// comments means a section of the glTF 2.0 specification.
namespace relume::gltf {

// What was left out or replaced; each note once, in order of appearance.
class Notes {
  public:
    void Add(const std::string& note);
    std::vector<std::string> Take() { return std::move(notes_); }

  private:
    std::vector<std::string> notes_;
};

// A parsed file. tinygltf gets the JSON without buffers and images, so that it never touches a
// file; those two are read here, by name, from a FileSource.
struct Document {
    struct Buffer {
        std::string uri;  // empty: the binary chunk of a .glb
        std::uint64_t byte_length = 0;
    };
    struct Image {
        std::string name, uri;  // uri is empty if the picture is in a buffer view
        int buffer_view = -1;
    };

    std::string name;  // of the file, for messages
    tinygltf::Model model;
    std::vector<Buffer> buffers;
    std::vector<Image> images;
    std::string binary_chunk;
    bool has_other_animations = false;  // of other things than nodes: taken out

    // "a.gltf: material 3 'bricks'"
    SourceLocation Place(const char* kind, std::size_t index, const std::string& item_name) const;
};

struct Poses;  // gltf_animation.h

// Throws naming file, line and column of malformed JSON, a wrong version, or a required extension
// that is not known.
Document ParseDocument(const FileSource& files, const std::string& name);

// The element at `index`, or an Error that says that `what` does not exist.
template <class T>
const T& At(const std::vector<T>& items, int index, const SourceLocation& place, const char* what);

// Extensions whose meaning, or at least harmlessness, is known here.
bool IsKnownExtension(const std::string& name);

// A document with its buffers: reads accessors, with every bound checked. Thread-safe. Embedded
// buffers are moved out of the document, which must outlive it.
class Data {
  public:
    Data(Document* document, const FileSource& files, std::uint64_t most_bytes);

    // `components` floats an element; integers are converted, and scaled if normalised
    // (section 3.6.2.2).
    std::vector<float> Floats(int accessor, int components, const SourceLocation& place) const;
    std::vector<std::uint32_t> Indices(int accessor, const SourceLocation& place) const;
    std::string_view View(int buffer_view, const SourceLocation& place) const;

  private:
    struct Elements;
    Elements Resolve(int buffer_view, std::uint64_t byte_offset, std::uint64_t count,
                     int component_type, int components, const SourceLocation& place) const;
    const tinygltf::Accessor& CheckedAccessor(int accessor, int components,
                                              const SourceLocation& place) const;
    // Overwrites some of the `components`-tuples in `values` (section 3.6.2.3).
    void ApplySparse(const tinygltf::Accessor& accessor, int components,
                     const SourceLocation& place, std::vector<float>* values) const;

    // Counts what is about to be made of an accessor.
    void Count(std::uint64_t elements, int components, const SourceLocation& place) const;

    const Document& document_;
    std::shared_ptr<const std::vector<std::string>> buffers_;
    mutable ArrayRoom room_;
};

// What the nodes of the default scene place. Meshes are indices of the file's meshes.
struct Placed {
    struct MeshUse {
        int mesh = 0, node = 0;
        int skin = -1;  // -1: none
        SampledTransform to_world;
        SourceLocation place;  // of the node
    };
    std::vector<MeshUse> meshes;  // depth first, children in order
    std::vector<Light> lights;
    std::vector<Camera> cameras;
    std::map<int, SampledTransform> to_world_of;  // of every node, if the file has skins
};
Placed ReadNodes(const Document& document, const Poses& poses, Notes* notes);

// The materials that the placed meshes use, in the file's order, and their textures and pictures.
struct Look {
    struct Picture {
        int image = 0;  // of the file
        SourceLocation wanted_by;
    };
    std::vector<Material> materials;  // at least one
    std::vector<int> uv_sets;         // as materials: n of the TEXCOORD_n that its textures use
    std::map<int, int> material_of;   // from the file's index; -1 = the default material
    std::vector<Texture> textures;    // Texture::image is an index of `pictures`
    std::vector<Picture> pictures;    // each distinct file or buffer view once
};
Look ReadMaterials(const Document& document, const Placed& placed, Notes* notes);

// One Mesh for each primitive of triangles that `placed` uses, and one Instance for each use of it.
// Uses that deform the mesh, by a skin or morph targets, have one of their own.
void ReadMeshes(const Document& document, const Data& data, const Poses& poses,
                const Placed& placed, const Look& look, Scene* scene, Notes* notes);

[[noreturn]] void Fail(const SourceLocation& place, const std::string& problem);

template <class T>
const T& At(const std::vector<T>& items, int index, const SourceLocation& place, const char* what) {
    if (index < 0 || static_cast<std::size_t>(index) >= items.size()) {
        Fail(place, fmt::format("{} {} does not exist (there are {}); export the scene again", what,
                                index, items.size()));
    }
    return items[static_cast<std::size_t>(index)];
}

}  // namespace relume::gltf
