#pragma once

#include <array>
#include <deque>
#include <map>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "core/scene/array_room.h"
#include "core/scene/formats.h"
#include "core/scene/scene.h"
#include "core/scene/text_place.h"

// The parts of the OBJ loader (load_obj.cpp); nothing else includes this. Not tinyobjloader: that
// takes what is no number (a NaN, too) for 0, and names no line of a wrong index.
namespace relume::obj {

using text::Fail;
using text::Notes;
using text::PathToName;
using text::Place;

// The lines of a file as words. A backslash at a line's end joins it with the next; a word that
// begins with '#' begins a comment. `name` and `bytes` must outlive it.
class Lines {
  public:
    Lines(const std::string* name, std::string_view bytes) : name_(name), bytes_(bytes) {}

    // False at the end; lines without words are skipped.
    bool Next();
    const std::vector<std::string_view>& words() const { return words_; }
    Place At(std::size_t word) const;  // of this line
    // The words from this one on as they stand, blanks between them included: a name.
    std::string Rest(std::size_t word) const;
    // The number that a word spells; throws if it is none, or not finite. "f 1" has one word after
    // the first: asking for more throws, too.
    float Number(std::size_t word) const;

  private:
    const std::string* name_;
    std::string_view bytes_;
    std::size_t at_ = 0, line_begin_ = 0;
    int line_ = 1, first_line_ = 0;  // the current words' first line
    std::size_t first_begin_ = 0;
    std::vector<std::string_view> words_;
};

struct Corner {
    int position = -1, uv = -1, normal = -1;  // indices; -1: none
};

// Consecutive faces of equal state.
struct Part {
    std::string name;   // of object and group
    int material = -1;  // index of Document::material_uses
    int smoothing = 0;  // group; 0: off
    std::size_t first_face = 0;
    Place place;
};

struct Document {
    std::deque<std::string> names;  // of files, for places; the first is the main one
    std::vector<Vec3f> positions, normals;
    std::vector<Vec2f> uvs;  // v up, as in the file
    std::vector<Corner> corners;
    std::vector<std::size_t> faces;  // where each one's corners begin, and the end
    std::vector<Part> parts;

    struct Named {
        std::string name;
        Place place;
    };
    std::vector<Named> material_uses;  // each name once
    std::vector<Named> libraries;      // mtllib, as written
};

// Throws naming file, line and column of what is not OBJ, or has no room.
void ParseDocument(const FileSource& files, const std::string& name, Document* document,
                   Notes* notes, ArrayRoom* room);

// A picture with its options.
struct Map {
    std::string name;  // in the FileSource
    Place place;
    Vec2f scale{1, 1}, offset{0, 0};  // uv' = scale uv + offset, v up
    bool clamp = false;
    float bump = 1;
    char channel = 0;  // r, g, b, m (matte), l (luminance); 0: does not say
};

// A material of an MTL file as it stands there.
struct MtlMaterial {
    std::string name;
    Place place;
    std::map<std::string, Rgb> colors;     // Kd Ks Ke Tf
    std::map<std::string, float> numbers;  // Ns Ni d Pr Pm Ps Pc Pcr illum
    std::map<std::string, Map> maps;       // map_Kd map_Ks map_Ke map_d bump norm map_Pr ...
};

// Reads the libraries that a document names, each once; what is missing is noted. `names` are those
// that were found.
std::vector<MtlMaterial> ReadLibraries(const FileSource& files, Document* document,
                                       std::vector<std::string>* names, Notes* notes);
// One library, `name` already among the document's names.
void ParseLibrary(const std::string* name, std::string_view bytes,
                  std::vector<MtlMaterial>* materials, Notes* notes);

// One Mesh for each pair of name and material, and one Instance of it. `material_of`: from an index
// of material_uses, plus 1, to Scene's (0: of faces without one).
void MakeMeshes(const Document& document, const std::vector<int>& material_of, Scene* scene,
                Notes* notes, ArrayRoom* room);

}  // namespace relume::obj
