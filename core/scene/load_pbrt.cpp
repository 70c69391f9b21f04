#include <fmt/format.h>

#include <algorithm>
#include <map>
#include <optional>
#include <set>
#include <utility>

#include "core/base/error.h"
#include "core/base/parallel.h"
#include "core/scene/pbrt_lights.h"
#include "core/scene/pbrt_materials.h"
#include "core/scene/pbrt_motion.h"
#include "core/scene/pbrt_shapes.h"

// pbrt's text format, versions 3 and 4: https://pbrt.org/fileformat-v3, fileformat-v4. A file is
// parsed (pbrt_document), shapes become triangles (pbrt_shapes), textures look-ups of pictures
// (pbrt_textures), materials, lights and the camera what scene.h lists. Spectra are reduced to RGB.
// What is left out or replaced is said in Scene::notes with file and line. How to render (filter,
// sampler, integrator) is Relume's own choice; sizes and counts are kept as Scene::hints.

namespace relume {
namespace pbrt {
namespace {

constexpr std::size_t kMaxInstances = std::size_t{1} << 24;

// A mesh to be made, and where it is used.
struct MeshPlan {
    std::vector<const Shape*> shapes;
    int material = 0;
};
struct Placement {
    std::size_t mesh = 0;
    SampledTransform to_parent;  // world, or object
};

class Loader {
  public:
    Loader(const FileSource& files, const std::string& main_name, const LoadOptions& options)
        : files_(files),
          room_(options.most_array_bytes),
          tokens_(files, main_name),
          document_(ParseDocument(&tokens_, &notes_, &room_)),
          spectra_(files, document_.version3, &notes_),
          textures_(document_, &spectra_, &notes_),
          materials_(document_, &textures_, &spectra_, &notes_) {
        scene_.name = main_name;
        times_ = ShutterTimes(document_, options);
        ReadCamera(document_, times_, &scene_, &notes_);
        lights_ = ReadLights(document_, &textures_, &spectra_, &scene_, &notes_);
        PlanMeshes();
    }

    Scene Load(const LoadOptions& options) {
        MakeMeshes();
        scene_.materials = std::move(materials_.all());
        if (scene_.materials.empty()) {
            scene_.materials.push_back({"default", "diffuse", {}, "the default material"});
        }
        ScalePowerLights();
        PlaceInstances();
        std::vector<int> kept;
        kept.reserve(lights_.pictured.size() + 1);
        for (const PicturedLight& light : lights_.pictured) {
            kept.push_back(light.picture);
        }
        const bool has_map = lights_.environment.picture >= 0;
        if (has_map) {
            kept.push_back(lights_.environment.picture);
        }
        textures_.Finish(files_, options.decode_images, &scene_, &kept);
        for (std::size_t i = 0; i < lights_.pictured.size(); ++i) {
            lights_.pictured[i].picture = kept[i];
        }
        lights_.environment.picture = has_map ? kept.back() : -1;
        FinishLights(lights_, &scene_, &notes_);
        AddEnvironment(files_, options, &scene_);
        scene_.notes = notes_.Take();
        return std::move(scene_);
    }

    std::vector<std::string> Files() const {
        std::vector<std::string> names = document_.names;
        for (const MeshPlan& plan : plans_) {
            if (plan.shapes.front()->is.type == "plymesh") {
                names.push_back(PlyName(*plan.shapes.front()));
            }
        }
        for (const ImageRequest& request : textures_.requests()) {
            names.push_back(request.name);
        }
        names.insert(names.end(), spectra_.names().begin(), spectra_.names().end());
        std::set<std::string> seen;
        std::vector<std::string> once;
        for (std::string& name : names) {
            if (seen.insert(name).second) {
                once.push_back(std::move(name));
            }
        }
        return once;
    }

  private:
    void PlanMeshes() {
        std::vector<bool> used(document_.objects.size());
        for (const ObjectUse& use : document_.uses) {
            used[static_cast<std::size_t>(use.object)] = true;
        }
        for (const Shape& shape : document_.shapes) {
            Plan(shape, false, &world_);
        }
        objects_.resize(document_.objects.size());
        for (std::size_t i = 0; i < used.size(); ++i) {
            last_curve_.reset();
            for (const Shape& shape : document_.objects[i]) {
                if (used[i]) {
                    Plan(shape, true, &objects_[i]);
                }
            }
        }
    }

    void Plan(const Shape& shape, bool in_object, std::vector<Placement>* placements) {
        if (!IsSupportedShape(shape.is.type)) {
            notes_.Add(shape.is.place, fmt::format("shapes of type {} are not supported, and left "
                                                   "out",
                                                   shape.is.type));
            return;
        }
        const int material = materials_.Of(shape, in_object);
        if (material < 0) {
            return;
        }
        const bool shines = shape.area_light >= 0 && !in_object;
        const std::string key = shines ? "" : ShareKey(shape);
        const bool curve = shape.is.type == "curve" && !shines;
        if (curve && last_curve_ && Joins(shape, material)) {
            plans_[*last_curve_].shapes.push_back(&shape);
            return;
        }
        last_curve_.reset();
        const auto known = key.empty() ? shared_.end() : shared_.find({key, material});
        std::size_t mesh = plans_.size();
        if (known != shared_.end()) {
            mesh = known->second;
        } else {
            room_.ForOneMore(plans_, [&] { return shape.is.place.Text(); });
            plans_.push_back({{&shape}, material});
            if (!key.empty()) {
                shared_[{key, material}] = mesh;
            }
        }
        if (curve) {
            last_curve_ = mesh;
        }
        const SampledTransform to_world =
            SampleBetween(shape.to_world, document_.transform_times, times_, shape.is.place);
        moves_ = moves_ || shape.to_world.moves();
        room_.ForOneMore(*placements, [&] { return shape.is.place.Text(); });
        room_.Take(to_world.size() * sizeof(Transform), [&] { return shape.is.place.Text(); });
        placements->push_back({mesh, Multiply(to_world, {MeshToShape(shape)})});
    }

    // Whether a curve can go into the mesh of the one before: files have one shape a hair.
    bool Joins(const Shape& shape, int material) const {
        const MeshPlan& last = plans_[*last_curve_];
        const Shape& first = *last.shapes.front();
        return last.material == material && first.reverse == shape.reverse &&
               first.to_world == shape.to_world;
    }

    void MakeMeshes() {
        room_.Reserve(&scene_.meshes, plans_.size(), [&] { return scene_.name; });
        scene_.meshes.resize(plans_.size());
        // Kept by index: which error and notes are told must not depend on threads.
        std::vector<std::optional<Error>> errors(plans_.size());
        std::vector<Notes> notes(plans_.size());
        ParallelFor(0, plans_.size(), 1, [&](std::size_t begin, std::size_t end) {
            for (std::size_t i = begin; i < end; ++i) {
                Mesh& mesh = scene_.meshes[i];
                try {
                    MakeMesh(plans_[i].shapes, files_, &mesh, &notes[i], &room_);
                    mesh.material = plans_[i].material;
                    mesh.name = plans_[i].shapes.front()->is.type;
                    if (mesh.uvs.empty() && materials_.HasTextures(mesh.material)) {
                        AddDefaultUvs(&mesh, &room_);
                    }
                } catch (const Error& error) {
                    errors[i] = error;
                }
            }
        });
        for (std::size_t i = 0; i < plans_.size(); ++i) {
            if (errors[i]) {
                throw *errors[i];
            }
            notes_.Merge(notes[i]);
            for (const Shape* shape : plans_[i].shapes) {
                shape->is.params.NoteUnused(fmt::format("shape of type {}", shape->is.type),
                                            &notes_);
            }
        }
    }

    void ScalePowerLights() {
        for (const Materials::PowerLight& light : materials_.power_lights()) {
            double area = 0;
            std::size_t triangles = 1;
            for (const Placement& placement : world_) {
                const Mesh& mesh = scene_.meshes[placement.mesh];
                if (mesh.material != light.material) {
                    continue;
                }
                triangles = light.each_triangle ? mesh.triangles.size() : 1;
                for (const Vec3u& t : mesh.triangles) {
                    const Vec3f p = mesh.positions[t.x];
                    const Transform& to_world = placement.to_parent.front();
                    area += 0.5 * Length(Cross(to_world.Vector(mesh.positions[t.y] - p),
                                               to_world.Vector(mesh.positions[t.z] - p)));
                }
            }
            if (area > 0) {
                ParamSet& params =
                    scene_.materials[static_cast<std::size_t>(light.material)].params;
                std::vector<float> emissive = params.GetFloats("emissive", {0, 0, 0});
                for (float& channel : emissive) {
                    channel *= static_cast<float>(static_cast<double>(triangles) /
                                                  (area * kPi * light.sides));
                }
                params.Set("emissive", emissive);
            }
        }
    }

    // Drops meshes without triangles and places the others.
    void PlaceInstances() {
        std::vector<int> index_of(scene_.meshes.size(), -1);
        std::vector<Mesh> kept;
        for (std::size_t i = 0; i < scene_.meshes.size(); ++i) {
            if (scene_.meshes[i].triangles.empty()) {
                notes_.Add(plans_[i].shapes.front()->is.place,
                           "shapes without triangles are left "
                           "out");
                continue;
            }
            index_of[i] = static_cast<int>(kept.size());
            kept.push_back(std::move(scene_.meshes[i]));
        }
        scene_.meshes = std::move(kept);
        const auto place = [&](const Placement& placement, const SampledTransform& to_world,
                               const auto& where) {
            if (index_of[placement.mesh] >= 0) {
                std::vector<Transform> motion = MotionKeys(to_world);
                room_.Take(motion.size() * sizeof(Transform), where);
                room_.ForOneMore(scene_.instances, where);
                scene_.instances.push_back(
                    {index_of[placement.mesh], to_world.front(), std::move(motion)});
            }
        };
        for (const Placement& placement : world_) {
            place(placement, placement.to_parent,
                  [&] { return plans_[placement.mesh].shapes.front()->is.place.Text(); });
        }
        for (const ObjectUse& use : document_.uses) {
            const auto& object = objects_[static_cast<std::size_t>(use.object)];
            if (scene_.instances.size() + object.size() > kMaxInstances) {
                Fail(use.place, fmt::format("the scene has more than {} instances of shapes; join "
                                            "the shapes of objects",
                                            kMaxInstances));
            }
            const SampledTransform to_world =
                SampleBetween(use.to_world, document_.transform_times, times_, use.place);
            moves_ = moves_ || use.to_world.moves();
            for (const Placement& placement : object) {
                place(placement, Multiply(to_world, placement.to_parent),
                      [&] { return use.place.Text(); });
            }
        }
        if (moves_ || document_.camera_from_world.moves()) {
            scene_.hints.animation_seconds = document_.transform_times[1];
        }
    }

    const FileSource& files_;
    ArrayRoom room_;
    Notes notes_;
    Tokens tokens_;
    Document document_;
    Spectra spectra_;
    Textures textures_;
    Materials materials_;
    Scene scene_;
    LightPlan lights_;
    std::vector<double> times_;
    bool moves_ = false;  // something may, at some time
    std::vector<MeshPlan> plans_;
    std::vector<Placement> world_;
    std::vector<std::vector<Placement>> objects_;
    std::map<std::pair<std::string, int>, std::size_t> shared_;
    std::optional<std::size_t> last_curve_;
};

}  // namespace
}  // namespace pbrt

Scene LoadPbrt(const FileSource& files, const std::string& main_name, const LoadOptions& options) {
    Scene scene = pbrt::Loader(files, main_name, options).Load(options);
    ValidateScene(scene);
    return scene;
}

std::vector<std::string> ListPbrtFiles(const FileSource& files, const std::string& main_name) {
    return pbrt::Loader(files, main_name, {}).Files();
}

}  // namespace relume
