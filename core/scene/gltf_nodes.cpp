#include <cmath>
#include <optional>

#include "core/scene/gltf_animation.h"

namespace relume::gltf {
namespace {

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
    NodeReader(const Document& document, const Poses& poses, Notes* notes)
        : document_(document), poses_(poses), notes_(notes) {}

    Placed Read() {
        const auto& model = document_.model;
        // Depth first, without recursion: a file may hold a chain of any length.
        std::vector<Visit> stack;
        const std::vector<int> roots = Roots();
        for (auto root = roots.rbegin(); root != roots.rend(); ++root) {
            stack.push_back({*root, {Transform()}, ""});
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
            const SampledTransform local = LocalTransforms(document_, visit.node, poses_, place);
            visit.to_world = Multiply(visit.to_world, local);
            if (visit.singular.empty() && !IsRegular(local, visit.to_world)) {
                visit.singular = place;
            }
            if (!model.skins.empty()) {
                placed_.to_world_of[visit.node] = visit.to_world;
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
        SampledTransform to_world;  // of the parent, until visited
        SourceLocation singular;    // the first node on the way whose transform can't be inverted
    };

    static bool IsRegular(const SampledTransform& local, const SampledTransform& to_world) {
        const auto regular = [](const Transform& transform) {
            const float determinant = transform.Determinant();
            return transform.IsFinite() && std::isfinite(determinant) && determinant != 0;
        };
        return std::all_of(local.begin(), local.end(), regular) &&
               std::all_of(to_world.begin(), to_world.end(), regular);
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
        // The place of a mesh with a skin is that of its joints.
        if (!visit.singular.empty() && node.skin < 0) {
            Fail(visit.singular,
                 "its transform is singular or not finite (a scale of 0?), and a mesh hangs on it; "
                 "give it a "
                 "scale other than 0 or remove it");
        }
        placed_.meshes.push_back({node.mesh, visit.node, node.skin, visit.to_world, place});
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
        SampledTransform to_world;
        for (const Transform& sample : visit.to_world) {
            to_world.push_back(RigidOrFail(sample, place));
        }
        camera.to_world = to_world.front();
        camera.motion = MotionKeys(to_world);
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
        if (visit.to_world.size() > 1) {
            notes_->Add(light.source +
                        ": moves while the shutter is open: it stays where it is at half time");
        }
        light.to_world = RigidOrFail(visit.to_world[visit.to_world.size() / 2], place);
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

    static Transform RigidOrFail(const Transform& to_world, const SourceLocation& place) {
        const std::optional<Transform> rigid = Rigid(to_world);
        if (!rigid) {
            Fail(place,
                 "its transform is singular or not finite (a scale of 0?); correct the node");
        }
        return *rigid;
    }

    const Document& document_;
    const Poses& poses_;
    Notes* notes_;
    Placed placed_;
};

}  // namespace

Placed ReadNodes(const Document& document, const Poses& poses, Notes* notes) {
    return NodeReader(document, poses, notes).Read();
}

}  // namespace relume::gltf
