#include "core/scene/pbrt_document.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <memory>
#include <utility>

#include "core/scene/pbrt_state.h"

namespace relume::pbrt {
namespace {

// Directives of rendering, not of the scene: Relume's own options decide these.
constexpr std::string_view kSettings[] = {"PixelFilter", "Accelerator", "SurfaceIntegrator",
                                          "VolumeIntegrator", "Renderer"};

constexpr std::string_view kMaterials3[] = {"matte",  "plastic", "substrate",   "metal",
                                            "mirror", "glass",   "uber",        "translucent",
                                            "disney", "fourier", "kdsubsurface"};

class Parser {
  public:
    Parser(Tokens* tokens, Notes* notes, ArrayRoom* room)
        : tokens_(tokens), notes_(notes), room_(room) {}

    Document Parse() {
        while (true) {
            tokens_->Peek();
            while (!imports_.empty() && tokens_->depth() < imports_.back().depth) {
                state_.End(StateStack::Block::kImport, imports_.back().place);
                imports_.pop_back();
            }
            const std::optional<Token> token = tokens_->Next();
            if (!token) {
                break;
            }
            if (token->kind != Token::Kind::kWord) {
                Fail(token->place, fmt::format("expected a directive, found '{}'", token->text));
            }
            place_ = token->place;
            Directive(token->text);
        }
        state_.RequireClosed();
        document_.names = tokens_->names();
        return std::move(document_);
    }

  private:
    void Directive(const std::string& word) {
        if (TransformDirective(word) || BlockDirective(word) || SettingDirective(word)) {
            return;
        }
        GraphicsState& now = state_.now();
        if (word == "Shape") {
            AddShape();
        } else if (word == "Material") {
            now.material = AddMaterial(Declare("material"));
        } else if (word == "MakeNamedMaterial") {
            Declared material = Declare("material");
            material.name = std::exchange(material.type, "");
            material.type = material.params.String("type", "");
            if (material.type.empty()) {
                Fail(place_, fmt::format("the material '{}' has no \"string type\"; add it",
                                         material.name));
            }
            const std::string name = material.name;
            document_.material_names.Add(name, AddMaterial(std::move(material)));
        } else if (word == "NamedMaterial") {
            UseMaterial(String("the name of a material"));
        } else if (word == "Texture") {
            AddTexture();
        } else if (word == "LightSource") {
            if (now.ctm.moves()) {
                notes_->Add(place_,
                            "motion of a light (ActiveTransform) is not rendered: it stays "
                            "where it is at the start");
            }
            Add(PlacedLight{Declare("light"), now.ctm.at[0]}, &document_.lights);
        } else if (word == "AreaLightSource") {
            now.area_light = static_cast<int>(document_.area_lights.size());
            Add(Declare("light"), &document_.area_lights);
        } else if (word == "MakeNamedMedium") {
            Declared medium = Declare("medium");
            const std::string name = medium.type;
            medium.type = medium.params.String("type", "homogeneous");
            document_.media[name] = std::move(medium);
        } else if (word == "MediumInterface") {
            now.media.inside = String("the name of a medium");
            const Token* next = tokens_->Peek();
            const bool two = next != nullptr && next->kind == Token::Kind::kString;
            now.media.outside = two ? String("the name of a medium") : now.media.inside;
        } else if (word == "Include" || word == "Import") {
            const std::string path = String("the name of a file");
            tokens_->Include(path, place_);
            if (word == "Import") {  // what it sets holds in it alone
                state_.Begin(StateStack::Block::kImport, place_);
                imports_.push_back({tokens_->depth(), place_});
            }
        } else {
            Fail(place_, fmt::format("the directive '{}' is not known; correct it", word));
        }
    }

    bool TransformDirective(const std::string& word) {
        if (word == "Identity") {
            state_.Replace(Transform());
        } else if (word == "Translate") {
            const auto v = Numbers<3>();
            state_.Concatenate(Transform::Translate({v[0], v[1], v[2]}));
        } else if (word == "Scale") {
            const auto v = Numbers<3>();
            state_.Concatenate(Transform::Scale({v[0], v[1], v[2]}));
        } else if (word == "Rotate") {
            const auto v = Numbers<4>();
            state_.Concatenate(Rotate(v[0], {v[1], v[2], v[3]}, place_));
        } else if (word == "LookAt") {
            state_.Concatenate(LookAt(Numbers<9>(), place_));
        } else if (word == "Transform") {
            state_.Replace(FromMatrix(Numbers<16>(), place_));
        } else if (word == "ConcatTransform") {
            state_.Concatenate(FromMatrix(Numbers<16>(), place_));
        } else if (word == "CoordinateSystem") {
            state_.NameCoordinates(String("the name of a coordinate system"));
        } else if (word == "CoordSysTransform") {
            const std::string name = String("the name of a coordinate system");
            if (!state_.UseCoordinates(name)) {
                notes_->Add(place_, fmt::format("the coordinate system '{}' is not known: "
                                                "CoordSysTransform is ignored",
                                                name));
            }
        } else if (word == "ActiveTransform") {
            const std::optional<Token> which = tokens_->Next();
            const std::string name = which ? which->text : "";
            if (name != "StartTime" && name != "EndTime" && name != "All") {
                Fail(place_, fmt::format("ActiveTransform takes StartTime, EndTime or All, not "
                                         "'{}'",
                                         name));
            }
            state_.now().active[0] = name != "EndTime";
            state_.now().active[1] = name != "StartTime";
        } else if (word == "TransformTimes") {
            document_.transform_times = Numbers<2>();
            if (!(document_.transform_times[0] < document_.transform_times[1])) {
                Fail(place_, "TransformTimes: the second time must be later than the first");
            }
        } else if (word == "ReverseOrientation") {
            state_.now().reverse = !state_.now().reverse;
        } else {
            return false;
        }
        return true;
    }

    bool BlockDirective(const std::string& word) {
        using Block = StateStack::Block;
        if (word == "AttributeBegin" || word == "TransformBegin") {
            state_.Begin(word[0] == 'A' ? Block::kAttribute : Block::kTransform, place_);
        } else if (word == "AttributeEnd" || word == "TransformEnd") {
            state_.End(word[0] == 'A' ? Block::kAttribute : Block::kTransform, place_);
        } else if (word == "WorldBegin") {
            GraphicsState& now = state_.now();
            now.ctm = Ctm();
            now.active[0] = now.active[1] = true;
            state_.NameCoordinates("world");
        } else if (word == "WorldEnd") {
            document_.version3 = true;
        } else if (word == "ObjectBegin") {
            if (object_ >= 0) {
                Fail(place_, "ObjectBegin inside of an object; close that first");
            }
            const std::string name = String("the name of an object");
            state_.Begin(Block::kObject, place_);
            object_ = static_cast<int>(document_.objects.size());
            object_names_.Add(name, object_);
            Add(std::vector<Shape>(), &document_.objects);
        } else if (word == "ObjectEnd") {
            state_.End(Block::kObject, place_);
            object_ = -1;
        } else if (word == "ObjectInstance") {
            const std::string name = String("the name of an object");
            const int index = object_names_.Find(name, static_cast<int>(document_.objects.size()));
            if (index < 0) {
                Fail(place_, fmt::format("the object '{}' is not known; define it before with "
                                         "ObjectBegin",
                                         name));
            }
            if (object_ >= 0) {
                Fail(place_, "ObjectInstance inside of an object; move it out");
            }
            Add(ObjectUse{index, state_.now().ctm, place_}, &document_.uses);
        } else {
            return false;
        }
        return true;
    }

    bool SettingDirective(const std::string& word) {
        if (word == "Camera") {
            document_.camera = Declare("camera");
            document_.camera_from_world = state_.now().ctm;
            const auto& ends = document_.camera_from_world.at;
            state_.NameCoordinates("camera", {{Inverse(ends[0], place_, "Camera"),
                                               Inverse(ends[1], place_, "Camera")}});
        } else if (word == "Film") {
            document_.film = Declare("film");
            document_.version3 = document_.version3 || document_.film.type == "image";
        } else if (word == "Sampler") {
            document_.sampler = Declare("sampler");
        } else if (word == "Integrator") {
            document_.integrator = Declare("integrator");
        } else if (word == "Attribute") {
            AddDefaults();
        } else if (word == "Option") {
            const std::optional<Token> name = tokens_->Next();
            const Token* value = tokens_->Peek();
            notes_->Add(place_, fmt::format("the option '{}' is ignored", name ? name->text : ""));
            if (value != nullptr) {
                tokens_->Next();
            }
        } else if (word == "ColorSpace") {
            const std::string name = String("the name of a colour space");
            if (name != "srgb") {
                notes_->Add(place_, fmt::format("the colour space '{}' is not supported: numbers "
                                                "are taken as Rec. 709",
                                                name));
            }
        } else if (std::find(std::begin(kSettings), std::end(kSettings), word) !=
                   std::end(kSettings)) {
            Declare("");
        } else {
            return false;
        }
        return true;
    }

    template <class T>
    void Add(T thing, std::vector<T>* to) {
        room_->ForOneMore(*to, [&] { return place_.Text(); });
        to->push_back(std::move(thing));
    }

    void AddShape() {
        const GraphicsState& now = state_.now();
        Shape shape;
        shape.is = Declare("shape");
        shape.to_world = now.ctm;
        shape.reverse = now.reverse;
        shape.material = now.material;
        shape.area_light = now.area_light;
        shape.media = now.media;
        auto& shapes =
            object_ >= 0 ? document_.objects[static_cast<std::size_t>(object_)] : document_.shapes;
        Add(std::move(shape), &shapes);
    }

    int AddMaterial(Declared material) {
        document_.version3 =
            document_.version3 || std::find(std::begin(kMaterials3), std::end(kMaterials3),
                                            material.type) != std::end(kMaterials3);
        Add(std::move(material), &document_.materials);
        document_.textures_before.push_back(static_cast<int>(document_.textures.size()));
        return static_cast<int>(document_.materials.size()) - 1;
    }

    void UseMaterial(const std::string& name) {
        const int index =
            document_.material_names.Find(name, static_cast<int>(document_.materials.size()));
        if (index < 0) {
            Fail(place_, fmt::format("the material '{}' is not known; define it before with "
                                     "MakeNamedMaterial",
                                     name));
        }
        state_.now().material = index;
    }

    void AddTexture() {
        const std::string name = String("the texture's name");
        const std::string kind = String("the texture's type, float or spectrum");
        if (kind != "float" && kind != "spectrum" && kind != "color") {
            Fail(place_, fmt::format("textures are of type float or spectrum, not '{}'", kind));
        }
        Declared texture = Declare("texture");
        texture.name = (kind == "float" ? "float " : "color ") + name;
        document_.texture_names.Add(texture.name, static_cast<int>(document_.textures.size()));
        Add(std::move(texture), &document_.textures);
    }

    void AddDefaults() {
        const std::string target = String("the target of the attributes");
        constexpr std::string_view kTargets[] = {"shape", "light", "material", "medium", "texture"};
        if (std::find(std::begin(kTargets), std::end(kTargets), target) == std::end(kTargets)) {
            Fail(place_, fmt::format("Attribute takes shape, light, material, medium or texture, "
                                     "not '{}'",
                                     target));
        }
        Params params = Params::Parse(tokens_, room_);
        auto& slot = state_.now().defaults[target];
        if (slot != nullptr) {
            if (slot->all().size() > 1000) {
                Fail(place_, "too many attributes");
            }
            room_->Take(slot->bytes(), [&] { return place_.Text(); });
            params.Append(*slot);
        }
        slot = std::make_shared<Params>(std::move(params));
    }

    // A directive's string and parameters; `target` names whose defaults apply.
    Declared Declare(const std::string& target) {
        Declared declared;
        declared.place = place_;
        declared.type = String("a type");
        declared.params = Params::Parse(tokens_, room_);
        const auto defaults = state_.now().defaults.find(target);
        if (defaults != state_.now().defaults.end()) {
            room_->Take(defaults->second->bytes(), [&] { return place_.Text(); });
            declared.params.Append(*defaults->second);
        }
        return declared;
    }

    std::string String(const char* what) {
        std::optional<Token> token = tokens_->Next();
        if (!token || token->kind != Token::Kind::kString) {
            Fail(token ? token->place : place_, fmt::format("expected {} in quotes", what));
        }
        return std::move(token->text);
    }

    // With or without brackets.
    template <std::size_t N>
    std::array<float, N> Numbers() {
        std::array<float, N> numbers{};
        const Token* next = tokens_->Peek();
        const bool bracket = next != nullptr && next->kind == Token::Kind::kOpen;
        if (bracket) {
            tokens_->Next();
        }
        for (float& number : numbers) {
            const std::optional<Token> token = tokens_->Next();
            if (!token) {
                Fail(place_, fmt::format("this directive takes {} numbers", N));
            }
            number = static_cast<float>(ParseNumber(*token, "a number"));
        }
        if (bracket) {
            const std::optional<Token> token = tokens_->Next();
            if (!token || token->kind != Token::Kind::kClose) {
                Fail(place_, fmt::format("this directive takes {} numbers in brackets", N));
            }
        }
        return numbers;
    }

    Tokens* tokens_;
    Notes* notes_;
    ArrayRoom* room_;
    Document document_;
    StateStack state_;
    Names object_names_;
    int object_ = -1;
    struct Import {
        std::size_t depth;  // of Tokens, in it
        Place place;
    };
    std::vector<Import> imports_;
    Place place_;  // of the current directive
};

}  // namespace

int Names::Find(const std::string& name, int before) const {
    const auto it = indices_.find(name);
    if (it == indices_.end()) {
        return -1;
    }
    const auto after = std::lower_bound(it->second.begin(), it->second.end(), before);
    return after == it->second.begin() ? *after : *(after - 1);
}

Document ParseDocument(Tokens* tokens, Notes* notes, ArrayRoom* room) {
    return Parser(tokens, notes, room).Parse();
}

}  // namespace relume::pbrt
