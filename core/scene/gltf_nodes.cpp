#include <array>
#include <cmath>
#include <optional>

#include "core/base/error.h"
#include "core/scene/gltf.h"

namespace relume::gltf {
namespace {

std::vector<float> Numbers(const std::vector<double>& values, std::size_t count, const char* what,
                           const SourceLocation& place) {
    if (values.size() != count) {
        Fail(place, fmt::format("its {} has {} numbers instead of {}; correct the node", what,
                                values.size(), count));
    }
    return {values.begin(), values.end()};
}

Transform Rotation(const std::vector<double>& quaternion, const SourceLocation& place) {
    const std::vector<float> q = Numbers(quaternion, 4, "rotation", place);
    const float length = std::sqrt(q[0] * q[0] + q[1] * q[1] + q[2] * q[2] + q[3] * q[3]);
    if (!(length > 0) || !std::isfinite(length)) {
        Fail(place, "its rotation is not a unit quaternion; correct the node");
    }
    return Transform::Rotate(q[0] / length, q[1] / length, q[2] / length, q[3] / length);
}

// Section 3.5.3: a matrix, or translation * rotation * scale.
Transform LocalTransform(const tinygltf::Node& node, const SourceLocation& place) {
    if (!node.matrix.empty()) {
        const std::vector<float> m = Numbers(node.matrix, 16, "matrix", place);
        std::array<float, 16> columns{};
        std::copy(m.begin(), m.end(), columns.begin());
        try {
            return Transform::FromColumns(columns);
        } catch (const Error& error) {
            Fail(place, fmt::format("{}; correct the node", error.what()));
        }
    }
    Transform transform;
    if (!node.translation.empty()) {
        const std::vector<float> t = Numbers(node.translation, 3, "translation", place);
        transform = Transform::Translate({t[0], t[1], t[2]});
    }
    if (!node.rotation.empty()) {
        transform = transform * Rotation(node.rotation, place);
    }
    if (!node.scale.empty()) {
        const std::vector<float> s = Numbers(node.scale, 3, "scale", place);
        transform = transform * Transform::Scale({s[0], s[1], s[2]});
    }
    return transform;
}

// Cameras and lights look along -z whatever their node's scale: position and axes without it. Empty
// if the axes span no space.
std::optional<Transform> Rigid(const Transform& transform) {
    const Vec3f z = transform.Vector({0, 0, 1});
    const Vec3f x = Cross(transform.Vector({0, 1, 0}), z);
    const Vec3f origin = transform.Point({0, 0, 0});
    const Vec3f unit_z = z / Length(z), unit_x = x / Length(x);
    if (!IsFinite(unit_z) || !IsFinite(unit_x) || !IsFinite(origin)) {
        return std::nullopt;
    }
    return Transform::LookAt(origin, origin - unit_z, Cross(unit_z, unit_x));
}

class NodeReader {
  public:
    NodeReader(const Document& document, Notes* notes) : document_(document), notes_(notes) {}

    Placed Read() {
        const auto& model = document_.model;
        // Depth first, without recursion: a file may hold a chain of any length.
        std::vector<Visit> stack;
        const std::vector<int> roots = Roots();
        for (auto root = roots.rbegin(); root != roots.rend(); ++root) {
            stack.push_back({*root, Transform(), ""});
        }
        std::vector<bool> seen(model.nodes.size(), false);
        while (!stack.empty()) {
            Visit visit = std::move(stack.back());
            stack.pop_back();
            const auto& node = At(model.nodes, visit.node, document_.name, "node");
            const auto index = static_cast<std::size_t>(visit.node);
            const SourceLocation place = document_.Place("node", index, node.name);
            if (seen[index]) {
                Fail(place,
                     "is reached twice, by two parents or by a cycle; nodes must form a tree: "
                     "correct the children");
            }
            seen[index] = true;
            const Transform local = LocalTransform(node, place);
            visit.to_world = visit.to_world * local;
            if (visit.singular.empty() && !IsRegular(local, visit.to_world)) {
                visit.singular = place;
            }
            AddMesh(node, visit, place);
            AddCamera(node, visit, place);
            AddLight(node, visit, place);
            for (auto child = node.children.rbegin(); child != node.children.rend(); ++child) {
                stack.push_back({*child, visit.to_world, visit.singular});
            }
        }
        return std::move(placed_);
    }

  private:
    struct Visit {
        int node = 0;
        Transform to_world;       // of the parent, until visited
        SourceLocation singular;  // the first node on the way whose transform can't be inverted
    };

    static bool IsRegular(const Transform& local, const Transform& to_world) {
        const float a = local.Determinant(), b = to_world.Determinant();
        return local.IsFinite() && to_world.IsFinite() && std::isfinite(a) && std::isfinite(b) &&
               a != 0 && b != 0;
    }

    // The default scene, else the first one, else all nodes that are nobody's child.
    std::vector<int> Roots() const {
        const auto& model = document_.model;
        if (!model.scenes.empty()) {
            if (model.scenes.size() > 1) {
                notes_->Add(fmt::format("{} scenes in the file: the default one is rendered",
                                        model.scenes.size()));
            }
            return At(model.scenes, std::max(model.defaultScene, 0), document_.name, "scene").nodes;
        }
        std::vector<bool> is_child(model.nodes.size(), false);
        for (const auto& node : model.nodes) {
            for (const int child : node.children) {
                if (child >= 0 && static_cast<std::size_t>(child) < is_child.size()) {
                    is_child[static_cast<std::size_t>(child)] = true;
                }
            }
        }
        std::vector<int> roots;
        for (std::size_t i = 0; i < is_child.size(); ++i) {
            if (!is_child[i]) {
                roots.push_back(static_cast<int>(i));
            }
        }
        return roots;
    }

    void AddMesh(const tinygltf::Node& node, const Visit& visit, const SourceLocation& place) {
        if (node.mesh < 0) {
            return;
        }
        At(document_.model.meshes, node.mesh, place, "mesh");
        if (!visit.singular.empty()) {
            Fail(visit.singular,
                 "its transform is singular or not finite (a scale of 0?), and a mesh hangs on it; "
                 "give it a "
                 "scale other than 0 or remove it");
        }
        placed_.meshes.push_back({node.mesh, visit.to_world, place});
    }

    void AddCamera(const tinygltf::Node& node, const Visit& visit, const SourceLocation& place) {
        if (node.camera < 0) {
            return;
        }
        const auto& from = At(document_.model.cameras, node.camera, place, "camera");
        Camera camera;
        camera.name = from.name.empty() ? node.name : from.name;
        camera.source = document_.Place("camera", static_cast<std::size_t>(node.camera), from.name);
        camera.type = from.type;
        camera.to_world = RigidOrFail(visit, place);
        const auto positive = [&](double value, const char* what, double limit) {
            if (!(value > 0) || !(value < limit)) {
                Fail(camera.source, fmt::format("{} is {}, not in (0, {}); correct the camera",
                                                what, value, limit));
            }
            camera.params.Set(what, static_cast<float>(value));
        };
        if (camera.type == "perspective") {
            positive(from.perspective.yfov, "yfov", 3.1415926);
            if (from.perspective.aspectRatio > 0) {
                camera.params.Set("aspect_ratio", static_cast<float>(from.perspective.aspectRatio));
            }
        } else if (camera.type == "orthographic") {
            positive(std::abs(from.orthographic.xmag), "xmag", 1e30);
            positive(std::abs(from.orthographic.ymag), "ymag", 1e30);
        } else {
            Fail(camera.source,
                 fmt::format("camera type '{}' is not known; export the scene again", camera.type));
        }
        placed_.cameras.push_back(std::move(camera));
    }

    // KHR_lights_punctual. Its photometric units are taken as radiometric ones, as emissive
    // textures are.
    void AddLight(const tinygltf::Node& node, const Visit& visit, const SourceLocation& place) {
        const auto extension = node.extensions.find("KHR_lights_punctual");
        if (extension == node.extensions.end() || !extension->second.Has("light")) {
            return;
        }
        const int index = extension->second.Get("light").GetNumberAsInt();
        const auto& from = At(document_.model.lights, index, place, "light");
        Light light;
        light.name = from.name.empty() ? node.name : from.name;
        light.source = document_.Place("light", static_cast<std::size_t>(index), from.name);
        light.type = from.type;
        light.to_world = RigidOrFail(visit, place);
        std::vector<float> power(3, static_cast<float>(from.intensity));
        if (!from.color.empty()) {
            const std::vector<float> color = Numbers(from.color, 3, "colour", light.source);
            for (std::size_t i = 0; i < 3; ++i) {
                power[i] *= color[i];
            }
        }
        for (const float p : power) {
            if (!std::isfinite(p) || p < 0) {
                Fail(light.source,
                     "its intensity or colour is negative or not finite; correct the light");
            }
        }
        if (light.type == "point" || light.type == "spot") {
            light.params.Set("intensity", power);
        } else if (light.type == "directional") {
            light.params.Set("irradiance", power);
        } else {
            Fail(light.source,
                 fmt::format("light type '{}' is not known; export the scene again", light.type));
        }
        if (light.type == "spot") {
            const double inner = from.spot.innerConeAngle, outer = from.spot.outerConeAngle;
            if (!(inner >= 0) || !(inner < outer) || !(outer <= 1.570797)) {
                Fail(light.source,
                     fmt::format("its cone angles are {} and {}; they must satisfy 0 <= inner < "
                                 "outer <= pi/2: correct the light",
                                 inner, outer));
            }
            light.params.Set("inner_angle", static_cast<float>(inner));
            light.params.Set("outer_angle", static_cast<float>(outer));
        }
        if (from.range > 0) {
            notes_->Add("the lights' range is ignored: they shine by the inverse square law alone");
        }
        placed_.lights.push_back(std::move(light));
    }

    static Transform RigidOrFail(const Visit& visit, const SourceLocation& place) {
        const std::optional<Transform> rigid = Rigid(visit.to_world);
        if (!rigid) {
            Fail(place,
                 "its transform is singular or not finite (a scale of 0?); correct the node");
        }
        return *rigid;
    }

    const Document& document_;
    Notes* notes_;
    Placed placed_;
};

}  // namespace

Placed ReadNodes(const Document& document, Notes* notes) {
    return NodeReader(document, notes).Read();
}

}  // namespace relume::gltf
