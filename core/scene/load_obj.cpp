#include <set>

#include "core/scene/obj_materials.h"

// Wavefront OBJ with its MTL libraries: groups and objects of polygons, normals given or made from
// smoothing groups, pictures. It has neither cameras nor lights but materials that shine; one unit
// is one unit of the scene.

namespace relume {

Scene LoadObj(const FileSource& files, const std::string& main_name, const LoadOptions& options) {
    Scene scene;
    scene.name = main_name;
    text::Notes notes;
    obj::Document document;
    ArrayRoom room(options.most_array_bytes);
    obj::ParseDocument(files, main_name, &document, &notes, &room);
    std::vector<std::string> libraries;
    obj::Materials materials(&notes);
    const std::vector<int> material_of =
        materials.Convert(document, obj::ReadLibraries(files, &document, &libraries, &notes));
    obj::MakeMeshes(document, material_of, &scene, &notes, &room);
    materials.Finish(files, options.decode_images, &scene);
    for (Mesh& mesh : scene.meshes) {
        bool textured = false;
        for (const auto& [name, value] :
             scene.materials[static_cast<std::size_t>(mesh.material)].params.values()) {
            textured = textured || name.ends_with("_texture");
        }
        if (textured && mesh.uvs.empty()) {
            notes.Add({}, mesh.source +
                              ": has no texture coordinates: its textures show their "
                              "corner pixel alone");
        }
    }
    AddEnvironment(files, options, &scene);
    scene.notes = notes.Take();
    ValidateScene(scene);
    return scene;
}

std::vector<std::string> ListObjFiles(const FileSource& files, const std::string& main_name) {
    text::Notes notes;
    obj::Document document;
    ArrayRoom room;
    obj::ParseDocument(files, main_name, &document, &notes, &room);
    std::vector<std::string> names{main_name};
    obj::Materials materials(&notes);
    materials.Convert(document, obj::ReadLibraries(files, &document, &names, &notes));
    std::set<std::string> seen(names.begin(), names.end());
    for (const ImageRequest& request : materials.requests()) {
        if (seen.insert(request.name).second) {
            names.push_back(request.name);
        }
    }
    return names;
}

}  // namespace relume
