#pragma once

#include <map>
#include <utility>
#include <vector>

#include "core/scene/gltf.h"
#include "core/scene/motion.h"

namespace relume::gltf {

// The properties of nodes that change over time (section 3.11). All animations of the file run
// together, each from time 0 and once: before its first key and after its last one a property is as
// there. Where two animate the same property, the first one does.
class Animations {
  public:
    enum class Path { kTranslation, kRotation, kScale, kWeights };

    Animations() = default;  // everything is at rest
    Animations(const Document& document, const Data& data, Notes* notes);

    // The property's value; empty if nothing animates it. Rotations have unit length. A scale of 0,
    // which hides things, is a very small one: a transform must not be singular.
    std::vector<float> At(int node, Path path, double seconds) const;
    // Whether something animates the node's translation, rotation or scale.
    bool MovesNode(int node) const;
    bool empty() const { return channels_.empty(); }
    double end() const { return end_; }  // seconds, of the last key

  private:
    enum class Interpolation { kLinear, kStep, kCubic };
    struct Channel {
        Interpolation interpolation = Interpolation::kLinear;
        std::vector<float> times;  // seconds, rising
        std::vector<float>
            values;  // a key: one value, or for kCubic in-tangent, value, out-tangent
        std::size_t components = 0;  // of a value
    };
    static Channel ReadChannel(const Data& data, const tinygltf::AnimationSampler& sampler,
                               Path path, const SourceLocation& place);

    std::map<std::pair<int, Path>, Channel> channels_;
    double end_ = 0;
};

// At which times the scene is looked at: SampleTimes of the shutter, or one.
struct Poses {
    const Animations* animations = nullptr;  // null: nothing is read of where nodes are
    std::vector<double> times;
};

// A node's transform to its parent, at all these times; one if it stands still.
SampledTransform LocalTransforms(const Document& document, int node, const Poses& poses,
                                 const SourceLocation& place);

// `count` numbers that a file's element must have.
std::vector<float> Numbers(const std::vector<double>& values, std::size_t count, const char* what,
                           const SourceLocation& place);

}  // namespace relume::gltf
