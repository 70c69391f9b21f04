#pragma once

#include <array>
#include <map>
#include <memory>
#include <string>
#include <vector>

#include "core/scene/pbrt_document.h"

namespace relume::pbrt {

// What AttributeBegin saves and AttributeEnd restores.
struct GraphicsState {
    Ctm ctm;
    bool active[2] = {true, true};  // which ends transformations apply to
    bool reverse = false;
    int material = -1, area_light = -1;
    Media media;
    // Defaults by target of the Attribute directive: "shape", "light", "material", ...
    std::map<std::string, std::shared_ptr<const Params>> defaults;
};

// The graphics state with its stack (at most 4096 deep) and the named coordinate systems.
class StateStack {
  public:
    GraphicsState& now() { return now_; }
    const GraphicsState& now() const { return now_; }

    // What opened a block closes it; a mismatch throws.
    enum class Block { kAttribute, kTransform, kObject, kImport };
    void Begin(Block block, const Place& place);
    void End(Block block, const Place& place);
    void RequireClosed() const;  // at the end of the file

    void Concatenate(const Transform& transform);
    void Replace(const Transform& transform);
    void NameCoordinates(const std::string& name) { coordinates_[name] = now_.ctm; }
    void NameCoordinates(const std::string& name, const Ctm& ctm) { coordinates_[name] = ctm; }
    // False if there is no such system.
    bool UseCoordinates(const std::string& name);

  private:
    struct Saved {
        Block block;
        Place place;
        GraphicsState state;
    };
    GraphicsState now_;
    std::vector<Saved> stack_;
    std::map<std::string, Ctm> coordinates_;
};

// World to camera, as pbrt's LookAt: camera space is left-handed and looks along +z. Throws if the
// three vectors span no space.
Transform LookAt(const std::array<float, 9>& eye_target_up, const Place& place);
Transform Rotate(float degrees, Vec3f axis, const Place& place);
// 16 numbers by columns; throws if they are not an affine map.
Transform FromMatrix(std::array<float, 16> columns, const Place& place);
// As Transform::Inverse, naming the place and what is singular.
Transform Inverse(const Transform& transform, const Place& place, const char* what);

}  // namespace relume::pbrt
