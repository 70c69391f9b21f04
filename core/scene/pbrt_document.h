#pragma once

#include <array>
#include <map>
#include <string>
#include <vector>

#include "core/math/transform.h"
#include "core/scene/pbrt_params.h"

// A parsed pbrt file: what the directives declare, with the graphics state that each thing was
// declared in, and nothing interpreted yet.
namespace relume::pbrt {

// A transformation at two times, see Document::transform_times.
struct Ctm {
    Transform at[2];

    bool moves() const { return !(at[0] == at[1]); }
    friend bool operator==(const Ctm&, const Ctm&) = default;
};

// Something with a type and parameters: Camera, Film, Material, Texture, LightSource, ...
struct Declared {
    std::string type, name;
    Params params;
    Place place;
};

struct Media {
    std::string inside, outside;  // names of media; "" = none
};

struct Shape {
    Declared is;
    Ctm to_world;          // in an object: to the object's space
    bool reverse = false;  // ReverseOrientation
    int material = -1;     // index of Document::materials; -1: the default
    int area_light = -1;   // index of Document::area_lights
    Media media;
};

struct PlacedLight {
    Declared is;
    Transform to_world;  // at the first of the two times
};

struct ObjectUse {
    int object = 0;  // index of Document::objects
    Ctm to_world;
    Place place;
};

// A name that may be declared more than once: each use means the latest declaration before it, or
// else the first one.
class Names {
  public:
    void Add(const std::string& name, int index) { indices_[name].push_back(index); }
    // `before`: how many things of that kind were declared when the name was used. -1 if unknown.
    int Find(const std::string& name, int before) const;

  private:
    std::map<std::string, std::vector<int>> indices_;
};

struct Document {
    std::vector<std::string> names;  // files that were parsed, main file first
    bool version3 = false;           // something was seen that only pbrt-v3 has

    Declared camera, film, sampler, integrator;  // empty type: absent
    Ctm camera_from_world;
    std::array<float, 2> transform_times{0, 1};  // seconds, of the two ends of a Ctm

    std::vector<Declared> textures;  // `type` is the class; `name` begins with "float " or "color "
    Names texture_names;
    std::vector<Declared> materials;   // named ones have a name
    std::vector<int> textures_before;  // as `materials`: how many textures were declared then
    Names material_names;
    std::vector<Declared> area_lights;
    std::map<std::string, Declared> media;

    std::vector<Shape> shapes;                // of the world
    std::vector<std::vector<Shape>> objects;  // shapes of each ObjectBegin
    std::vector<ObjectUse> uses;
    std::vector<PlacedLight> lights;
};

// `tokens` owns the names of places and must outlive the document. Throws naming file, line and
// column of anything that is not pbrt-v3's or v4's text format, or has no room.
Document ParseDocument(Tokens* tokens, Notes* notes, ArrayRoom* room);

}  // namespace relume::pbrt
