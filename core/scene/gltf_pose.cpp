#include <algorithm>
#include <array>
#include <cmath>

#include "core/base/error.h"
#include "core/scene/gltf_animation.h"

namespace relume::gltf {
namespace {

using Path = Animations::Path;

Transform Rotation(const std::vector<float>& q, const SourceLocation& place) {
    const float length = std::sqrt(q[0] * q[0] + q[1] * q[1] + q[2] * q[2] + q[3] * q[3]);
    if (!(length > 0) || !std::isfinite(length)) {
        Fail(place, "its rotation is not a unit quaternion; correct the node");
    }
    return Transform::Rotate(q[0] / length, q[1] / length, q[2] / length, q[3] / length);
}

Transform FromMatrix(const tinygltf::Node& node, const SourceLocation& place) {
    const std::vector<float> m = Numbers(node.matrix, 16, "matrix", place);
    std::array<float, 16> columns{};
    std::copy(m.begin(), m.end(), columns.begin());
    try {
        return Transform::FromColumns(columns);
    } catch (const Error& error) {
        Fail(place, fmt::format("{}; correct the node", error.what()));
    }
}

// Translation * rotation * scale, of which any may be missing.
Transform Compose(const std::vector<float>& t, const std::vector<float>& r,
                  const std::vector<float>& s, const SourceLocation& place) {
    Transform transform;
    if (!t.empty()) {
        transform = Transform::Translate({t[0], t[1], t[2]});
    }
    if (!r.empty()) {
        transform = transform * Rotation(r, place);
    }
    if (!s.empty()) {
        transform = transform * Transform::Scale({s[0], s[1], s[2]});
    }
    return transform;
}

}  // namespace

std::vector<float> Numbers(const std::vector<double>& values, std::size_t count, const char* what,
                           const SourceLocation& place) {
    if (values.size() != count) {
        Fail(place, fmt::format("its {} has {} numbers instead of {}; correct the node", what,
                                values.size(), count));
    }
    return {values.begin(), values.end()};
}

// Section 3.5.3: a matrix, or three properties, which animations replace.
SampledTransform LocalTransforms(const Document& document, int index, const Poses& poses,
                                 const SourceLocation& place) {
    if (poses.animations == nullptr) {
        return {Transform()};
    }
    const tinygltf::Node& node = document.model.nodes[static_cast<std::size_t>(index)];
    const bool moves = poses.animations->MovesNode(index);
    if (!node.matrix.empty()) {
        if (moves) {
            Fail(place,
                 "has a matrix and is animated, which only translation, rotation and scale can be; "
                 "export the scene again");
        }
        return {FromMatrix(node, place)};
    }
    const auto numbers = [&](const std::vector<double>& values, std::size_t count,
                             const char* what) {
        return values.empty() ? std::vector<float>() : Numbers(values, count, what, place);
    };
    const std::vector<float> t = numbers(node.translation, 3, "translation"),
                             r = numbers(node.rotation, 4, "rotation"),
                             s = numbers(node.scale, 3, "scale");
    if (!moves) {
        return {Compose(t, r, s, place)};
    }
    SampledTransform samples;
    for (const double seconds : poses.times) {
        const auto at = [&](Path path, const std::vector<float>& otherwise) {
            std::vector<float> value = poses.animations->At(index, path, seconds);
            return value.empty() ? otherwise : value;
        };
        samples.push_back(
            Compose(at(Path::kTranslation, t), at(Path::kRotation, r), at(Path::kScale, s), place));
    }
    if (KeysNeeded(samples) == 1) {
        samples.resize(1);
    }
    return samples;
}

}  // namespace relume::gltf
