#include "worker/render/bsdf/texture_packs.h"

#include <algorithm>
#include <map>
#include <optional>

namespace relume::render {
namespace {

constexpr int kPlain = -1, kNobody = -2, kSeveral = -3;

const Texture& TextureOf(const Scene& scene, TextureId id) {
    return scene.textures[static_cast<std::size_t>(id)];
}

bool SamePlaces(const Texture& a, const Texture& b, const Scene& scene) {
    const SceneImage& x = scene.images[static_cast<std::size_t>(a.image)];
    const SceneImage& y = scene.images[static_cast<std::size_t>(b.image)];
    return x.width == y.width && x.height == y.height && a.nearest == b.nearest &&
           a.wrap_u == b.wrap_u && a.wrap_v == b.wrap_v &&
           std::equal(a.uv_transform, a.uv_transform + 6, b.uv_transform);
}

// The pack that the material would be read by.
std::optional<TexturePack> Candidate(const Scene& scene, const CompiledMaterial& m) {
    if ((m.model != Model::kMetallicRoughness && m.model != Model::kLayered) || m.SeesThrough()) {
        return std::nullopt;
    }
    const TexturePack pack{m.base_color_texture, m.normal_texture, m.metallic_roughness_texture};
    const TextureId first = std::max({pack.base, pack.normal, pack.metallic_roughness});
    int count = 0;
    for (const TextureId id : {pack.base, pack.normal, pack.metallic_roughness}) {
        if (id < 0) {
            continue;
        }
        ++count;
        const Texture& texture = TextureOf(scene, id);
        if (scene.images[static_cast<std::size_t>(texture.image)].bytes.empty() ||
            texture.srgb != (id == pack.base) ||
            !SamePlaces(texture, TextureOf(scene, first), scene)) {
            return std::nullopt;
        }
    }
    return count >= 2 ? std::optional(pack) : std::nullopt;
}

}  // namespace

std::vector<TexturePack> PlanTexturePacks(const Scene& scene, const std::vector<bool>& used,
                                          std::vector<CompiledMaterial>* materials) {
    std::vector<TexturePack> candidates;
    std::vector<int> owner(scene.images.size(), kNobody);  // of each picture: a candidate
    const auto claim = [&](TextureId id, int by) {
        int& has = owner[static_cast<std::size_t>(TextureOf(scene, id).image)];
        has = has == kNobody || has == by ? by : kSeveral;
    };
    std::vector<int> of_material(materials->size(), kPlain);
    std::vector<bool> in_mix(materials->size(), false);
    for (const CompiledMaterial& m : *materials) {
        for (const int part : {m.mix_a, m.mix_b}) {
            if (part >= 0) {
                in_mix[static_cast<std::size_t>(part)] = true;
            }
        }
    }
    for (std::size_t i = 0; i < materials->size(); ++i) {
        const CompiledMaterial& m = (*materials)[i];
        if (!used[i]) {
            continue;
        }
        const auto pack = in_mix[i] ? std::nullopt : Candidate(scene, m);
        if (pack) {
            const auto known = std::find(candidates.begin(), candidates.end(), *pack);
            of_material[i] = static_cast<int>(known - candidates.begin());
            if (known == candidates.end()) {
                candidates.push_back(*pack);
            }
        }
        for (const TextureId id : m.Textures()) {
            if (id >= 0) {
                const bool packed = pack && (id == pack->base || id == pack->normal ||
                                             id == pack->metallic_roughness);
                claim(id, packed ? of_material[i] : kPlain);
            }
        }
    }
    std::vector<TexturePack> packs;
    std::vector<int> number(candidates.size(), -1);
    for (std::size_t c = 0; c < candidates.size(); ++c) {
        const TexturePack& pack = candidates[c];
        bool alone = true;
        for (const TextureId id : {pack.base, pack.normal, pack.metallic_roughness}) {
            alone =
                alone && (id < 0 || owner[static_cast<std::size_t>(TextureOf(scene, id).image)] ==
                                        static_cast<int>(c));
        }
        if (alone) {
            number[c] = static_cast<int>(packs.size());
            packs.push_back(pack);
        }
    }
    for (std::size_t i = 0; i < materials->size(); ++i) {
        if (of_material[i] >= 0) {
            (*materials)[i].pack = number[static_cast<std::size_t>(of_material[i])];
        }
    }
    return packs;
}

}  // namespace relume::render
