#include "core/scene/gltf_deform.h"

#include <algorithm>
#include <array>
#include <cmath>

#include "core/base/parallel.h"

namespace relume::gltf {
namespace {

constexpr std::size_t kVerticesPerTask = 4096;

// What a primitive says of the ways in which it deforms.
struct Shape {
    struct Target {  // empty, or one a vertex
        std::vector<Vec3f> positions, normals, tangents;
    };
    std::vector<Target> targets;
    // One after the other for each vertex; weights add up to 1.
    std::size_t influences = 0;
    std::vector<std::uint32_t> joints;
    std::vector<float> weights;
};

// The attribute of this name; empty if there is none.
std::vector<Vec3f> ReadTriples(const Data& data, const std::map<std::string, int>& attributes,
                               const char* name, const Mesh& mesh, const SourceLocation& place) {
    const auto found = attributes.find(name);
    if (found == attributes.end()) {
        return {};
    }
    const SourceLocation where = fmt::format("{}: {}", place, name);
    const std::vector<float> numbers = data.Floats(found->second, 3, where);
    if (numbers.size() != 3 * mesh.positions.size()) {
        Fail(where, fmt::format("{} values for {} vertices; export the scene again",
                                numbers.size() / 3, mesh.positions.size()));
    }
    std::vector<Vec3f> triples(mesh.positions.size());
    for (std::size_t i = 0; i < triples.size(); ++i) {
        triples[i] = {numbers[3 * i], numbers[3 * i + 1], numbers[3 * i + 2]};
    }
    return triples;
}

void ReadTargets(const Data& data, const tinygltf::Primitive& primitive, const Mesh& mesh,
                 Shape* shape) {
    for (std::size_t i = 0; i < primitive.targets.size(); ++i) {
        const auto& attributes = primitive.targets[i];
        const SourceLocation place = fmt::format("{}, morph target {}", mesh.source, i);
        Shape::Target target;
        target.positions = ReadTriples(data, attributes, "POSITION", mesh, place);
        if (!mesh.normals.empty()) {
            target.normals = ReadTriples(data, attributes, "NORMAL", mesh, place);
        }
        if (!mesh.tangents.empty()) {
            target.tangents = ReadTriples(data, attributes, "TANGENT", mesh, place);
        }
        shape->targets.push_back(std::move(target));
    }
}

// Sets of four joints and weights a vertex: JOINTS_0, WEIGHTS_0, JOINTS_1, ...
void ReadInfluences(const Data& data, const tinygltf::Primitive& primitive, const Mesh& mesh,
                    std::size_t joint_count, Shape* shape) {
    const std::size_t vertices = mesh.positions.size();
    std::vector<std::vector<float>> joints, weights;
    for (int set = 0;; ++set) {
        const std::string names[2] = {fmt::format("JOINTS_{}", set),
                                      fmt::format("WEIGHTS_{}", set)};
        const auto j = primitive.attributes.find(names[0]), w = primitive.attributes.find(names[1]);
        if (j == primitive.attributes.end() || w == primitive.attributes.end()) {
            if (set == 0) {
                Fail(mesh.source,
                     "hangs on a skin but has no JOINTS_0 and WEIGHTS_0; export the "
                     "scene again");
            }
            break;
        }
        joints.push_back(data.Floats(j->second, 4, mesh.source + ": " + names[0]));
        weights.push_back(data.Floats(w->second, 4, mesh.source + ": " + names[1]));
        if (joints.back().size() != 4 * vertices || weights.back().size() != 4 * vertices) {
            Fail(mesh.source,
                 fmt::format("{} joints and {} weights for {} vertices; export the "
                             "scene again",
                             joints.back().size() / 4, weights.back().size() / 4, vertices));
        }
    }
    shape->influences = 4 * joints.size();
    for (std::size_t v = 0; v < vertices; ++v) {
        float sum = 0;
        for (std::size_t set = 0; set < joints.size(); ++set) {
            for (std::size_t k = 4 * v; k < 4 * v + 4; ++k) {
                const float joint = joints[set][k], weight = weights[set][k];
                if (!(weight >= 0) || !std::isfinite(weight)) {
                    Fail(mesh.source,
                         fmt::format("vertex {} has a weight of {}; repair the skin", v, weight));
                }
                if (weight > 0 && (!(joint >= 0) || joint >= static_cast<float>(joint_count))) {
                    Fail(mesh.source, fmt::format("vertex {} hangs on joint {} of {}; export the "
                                                  "scene again",
                                                  v, joint, joint_count));
                }
                shape->joints.push_back(weight > 0 ? static_cast<std::uint32_t>(joint) : 0);
                shape->weights.push_back(weight);
                sum += weight;
            }
        }
        if (!(sum > 0)) {
            Fail(mesh.source, fmt::format("vertex {} hangs on no joint; repair the skin", v));
        }
        for (std::size_t k = v * shape->influences; k < (v + 1) * shape->influences; ++k) {
            shape->weights[k] /= sum;
        }
    }
}

Vec3f UnitOr(Vec3f v, Vec3f otherwise) {
    const float length = Length(v);
    return length > 0 && std::isfinite(length) ? v / length : otherwise;
}

const Transform& At(const SampledTransform& samples, std::size_t sample) {
    return samples[std::min(sample, samples.size() - 1)];
}

// The mesh at one of the samples' times; only positions if there is no room for the others.
void Pose(const Mesh& mesh, const Shape& shape, const std::vector<SampledTransform>& joints,
          const std::vector<float>& weights, std::size_t sample, std::vector<Vec3f>* positions,
          std::vector<Vec3f>* normals, std::vector<Vec3f>* tangents) {
    positions->resize(mesh.positions.size());
    const auto morph = [&](Vec3f v, std::size_t i, std::vector<Vec3f> Shape::Target::*what) {
        for (std::size_t t = 0; t < weights.size(); ++t) {
            const std::vector<Vec3f>& deltas = shape.targets[t].*what;
            if (weights[t] != 0 && !deltas.empty()) {
                v += deltas[i] * weights[t];
            }
        }
        return v;
    };
    ParallelFor(0, positions->size(), kVerticesPerTask, [&](std::size_t begin, std::size_t end) {
        for (std::size_t i = begin; i < end; ++i) {
            Transform to_world;
            if (shape.influences > 0) {
                std::array<float, 12> sum{};
                for (std::size_t k = i * shape.influences; k < (i + 1) * shape.influences; ++k) {
                    const auto& rows = At(joints[shape.joints[k]], sample).rows();
                    for (std::size_t r = 0; r < sum.size() && shape.weights[k] > 0; ++r) {
                        sum[r] += shape.weights[k] * rows[r];
                    }
                }
                to_world = Transform(sum);
            }
            (*positions)[i] =
                to_world.Point(morph(mesh.positions[i], i, &Shape::Target::positions));
            if (normals != nullptr && !mesh.normals.empty()) {
                const Vec3f n = morph(mesh.normals[i], i, &Shape::Target::normals);
                (*normals)[i] = UnitOr(to_world.Normal(n), mesh.normals[i]);
            }
            if (tangents != nullptr && !mesh.tangents.empty()) {
                const Vec3f t = morph(mesh.tangents[i], i, &Shape::Target::tangents);
                (*tangents)[i] = UnitOr(to_world.Vector(t), mesh.tangents[i]);
            }
        }
    });
}

bool HasTargets(const tinygltf::Mesh& mesh) {
    return std::any_of(mesh.primitives.begin(), mesh.primitives.end(),
                       [](const auto& primitive) { return !primitive.targets.empty(); });
}

}  // namespace

bool Deformer::Deforms(const Placed::MeshUse& use) const {
    return use.skin >= 0 || HasTargets(document_.model.meshes[static_cast<std::size_t>(use.mesh)]);
}

// An animation's, else the node's, else the mesh's, else 0; the last for all times if they stay.
SampledWeights Deformer::WeightsOf(const Placed::MeshUse& use) const {
    const auto& mesh = document_.model.meshes[static_cast<std::size_t>(use.mesh)];
    const auto& node = document_.model.nodes[static_cast<std::size_t>(use.node)];
    const auto& still = node.weights.empty() ? mesh.weights : node.weights;
    SampledWeights samples;
    for (const double seconds : poses_.times) {
        samples.push_back(poses_.animations->At(use.node, Animations::Path::kWeights, seconds));
        if (samples.back().empty()) {
            samples.back().assign(still.begin(), still.end());
        }
    }
    return samples;
}

const Deformer::Skin& Deformer::SkinOf(const Placed::MeshUse& use) {
    const auto [it, is_new] = skins_.try_emplace(use.skin);
    if (!is_new) {
        return it->second;
    }
    const auto& from = relume::gltf::At(document_.model.skins, use.skin, use.place, "skin");
    const SourceLocation place =
        document_.Place("skin", static_cast<std::size_t>(use.skin), from.name);
    std::vector<float> inverses;
    if (from.inverseBindMatrices >= 0) {
        inverses = data_.Floats(from.inverseBindMatrices, 16, place + ": inverse bind matrices");
        if (inverses.size() < 16 * from.joints.size()) {
            Fail(place,
                 fmt::format("{} inverse bind matrices for {} joints; export the scene again",
                             inverses.size() / 16, from.joints.size()));
        }
    }
    for (std::size_t j = 0; j < from.joints.size(); ++j) {
        const auto node = placed_.to_world_of.find(from.joints[j]);
        if (node == placed_.to_world_of.end()) {
            Fail(place, fmt::format("its joint, node {}, is not in the scene; export the scene "
                                    "again",
                                    from.joints[j]));
        }
        Transform inverse;
        if (!inverses.empty()) {
            std::array<float, 16> columns{};
            std::copy_n(inverses.begin() + static_cast<std::ptrdiff_t>(16 * j), 16,
                        columns.begin());
            columns[3] = columns[7] = columns[11] = 0;  // by definition, whatever the rounding
            columns[15] = 1;
            inverse = Transform::FromColumns(columns);
        }
        it->second.joints.push_back(Multiply(node->second, {inverse}));
        it->second.keys = std::max(it->second.keys, KeysNeeded(it->second.joints.back()));
    }
    return it->second;
}

void Deformer::Deform(const tinygltf::Primitive& primitive, const Placed::MeshUse& use,
                      Mesh* mesh) {
    // What is read.
    Shape shape;
    ReadTargets(data_, primitive, *mesh, &shape);
    static const std::vector<SampledTransform> kNoJoints;
    const std::vector<SampledTransform>* joints = &kNoJoints;
    std::size_t keys = 1;
    if (use.skin >= 0) {
        const Skin& skin = SkinOf(use);
        ReadInfluences(data_, primitive, *mesh, skin.joints.size(), &shape);
        joints = &skin.joints;
        keys = skin.keys;
    }
    SampledWeights weights = WeightsOf(use);
    if (weights.front().size() > shape.targets.size() ||
        (!weights.front().empty() && weights.front().size() < shape.targets.size())) {
        Fail(use.place, fmt::format("{} weights for {} morph targets; export the scene again",
                                    weights.front().size(), shape.targets.size()));
    }
    keys = std::max(keys, KeysNeeded(weights));

    // The keys, then what is constant.
    const Mesh base = *mesh;
    for (std::size_t k = 0; keys > 1 && k < keys; ++k) {
        const std::size_t sample = SampleOfKey(k, keys);
        mesh->motion.emplace_back();
        Pose(base, shape, *joints, weights[std::min(sample, weights.size() - 1)], sample,
             &mesh->motion.back(), nullptr, nullptr);
    }
    Pose(base, shape, *joints, weights.front(), 0, &mesh->positions, &mesh->normals,
         &mesh->tangents);
}

}  // namespace relume::gltf
