#include <fmt/format.h>

#include <algorithm>
#include <charconv>
#include <type_traits>
#include <unordered_map>
#include <utility>

#include "core/scene/obj.h"

// Wavefront OBJ: https://paulbourke.net/dataformats/obj/. Polygons and their state; curves and
// free-form surfaces, lines and points are left out with a note.

namespace relume::obj {
namespace {

// What says nothing about the shaded surface.
constexpr std::string_view kWithoutMeaning[] = {"vp",       "lod",        "bevel",    "c_interp",
                                                "d_interp", "shadow_obj", "trace_obj"};

class Parser {
  public:
    Parser(std::string_view bytes, Document* document, Notes* notes, ArrayRoom* room)
        : lines_(&document->names.front(), bytes),
          document_(*document),
          notes_(notes),
          room_(room) {}

    void Parse() {
        while (lines_.Next()) {
            Statement(lines_.words().front());
        }
        CheckForward(positions_, document_.positions.size(), "v");
        CheckForward(uvs_, document_.uvs.size(), "vt");
        CheckForward(normals_, document_.normals.size(), "vn");
        document_.faces.push_back(document_.corners.size());
    }

  private:
    // The largest index that was used before that many were there.
    struct Forward {
        int index = -1;
        Place place;
    };

    template <class T>
    void Add(std::type_identity_t<T> thing, std::vector<T>* to) {
        room_->ForOneMore(*to, [&] { return lines_.At(0).Text(); });
        to->push_back(std::move(thing));
    }

    void Statement(std::string_view word) {
        if (word == "v") {
            Add({lines_.Number(1), lines_.Number(2), lines_.Number(3)}, &document_.positions);
            if (lines_.words().size() >= 7) {
                notes_->Add(lines_.At(0), "vertex colours are ignored");
            }
        } else if (word == "vt") {
            const bool has_v = lines_.words().size() > 2;
            Add({lines_.Number(1), has_v ? lines_.Number(2) : 0}, &document_.uvs);
        } else if (word == "vn") {
            Add({lines_.Number(1), lines_.Number(2), lines_.Number(3)}, &document_.normals);
        } else if (word == "f" || word == "fo") {
            Face();
        } else if (word == "g") {
            group_ = lines_.Rest(1);
            changed_ = true;
        } else if (word == "o") {
            object_ = lines_.Rest(1);
            group_.clear();
            changed_ = true;
        } else if (word == "s") {
            Smoothing();
        } else if (word == "usemtl") {
            UseMaterial(lines_.Rest(1));
        } else if (word == "mtllib") {
            Add({lines_.Rest(1), lines_.At(0)}, &document_.libraries);
        } else if (word == "l" || word == "p") {
            notes_->Add(lines_.At(0), "points and lines are left out: they have no surface");
        } else if (std::find(std::begin(kWithoutMeaning), std::end(kWithoutMeaning), word) ==
                   std::end(kWithoutMeaning)) {
            notes_->Add(lines_.At(0),
                        fmt::format("'{}' is not supported, and ignored", word.substr(0, 32)));
        }
    }

    void Face() {
        const std::size_t corners = lines_.words().size() - 1;
        if (corners < 3) {
            Fail(lines_.At(0), fmt::format("a face needs 3 corners or more, it has {}; repair or "
                                           "remove the line",
                                           corners));
        }
        if (changed_) {
            Part part;
            part.name = group_.empty()    ? object_
                        : object_.empty() ? group_
                                          : object_ + " " + group_;
            part.material = material_;
            part.smoothing = smoothing_;
            part.first_face = document_.faces.size();
            part.place = lines_.At(0);
            Add(std::move(part), &document_.parts);
            changed_ = false;
        }
        Add(document_.corners.size(), &document_.faces);
        for (std::size_t i = 1; i <= corners; ++i) {
            Add(ReadCorner(i), &document_.corners);
        }
    }

    // "v", "v/vt", "v//vn" or "v/vt/vn".
    Corner ReadCorner(std::size_t word) {
        std::string_view rest = lines_.words()[word];
        const auto take = [&] {
            const std::size_t slash = std::min(rest.find('/'), rest.size());
            const std::string_view part = rest.substr(0, slash);
            rest.remove_prefix(std::min(slash + 1, rest.size()));
            return part;
        };
        Corner corner;
        corner.position = Index(take(), document_.positions.size(), word, &positions_);
        if (const std::string_view uv = take(); !uv.empty()) {
            corner.uv = Index(uv, document_.uvs.size(), word, &uvs_);
        }
        if (const std::string_view normal = take(); !normal.empty()) {
            corner.normal = Index(normal, document_.normals.size(), word, &normals_);
        }
        if (!rest.empty()) {
            Malformed(word);
        }
        return corner;
    }

    // From 1 up, or from -1 (the last one so far) down.
    int Index(std::string_view text, std::size_t count, std::size_t word, Forward* forward) const {
        int index = 0;
        const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), index);
        if (error != std::errc() || end != text.data() + text.size()) {
            Malformed(word);
        }
        if (index == 0 || (index < 0 && static_cast<std::size_t>(-std::int64_t{index}) > count)) {
            Fail(lines_.At(word), fmt::format("index {} of '{}' refers to nothing ({} so far, "
                                              "counted from 1); export the scene again",
                                              index, lines_.words()[word], count));
        }
        if (index < 0) {
            return static_cast<int>(count) + index;
        }
        if (static_cast<std::size_t>(index) > count && index - 1 > forward->index) {
            *forward = {index - 1, lines_.At(word)};
        }
        return index - 1;
    }

    [[noreturn]] void Malformed(std::size_t word) const {
        Fail(lines_.At(word),
             fmt::format("a face's corner must be v, v/vt, v//vn or v/vt/vn, not '{}'; repair the "
                         "line",
                         lines_.words()[word].substr(0, 64)));
    }

    static void CheckForward(const Forward& forward, std::size_t count, const char* kind) {
        if (forward.index >= 0 && static_cast<std::size_t>(forward.index) >= count) {
            Fail(forward.place,
                 fmt::format("index {} refers to no '{}' (the file has {}); export the scene again",
                             forward.index + 1, kind, count));
        }
    }

    void Smoothing() {
        const std::string group = lines_.Rest(1);
        if (group.empty() || group == "off" || group == "on") {
            smoothing_ = group == "on" ? 1 : 0;
        } else {
            smoothing_ = std::clamp(static_cast<int>(std::clamp(lines_.Number(1), 0.0f, 1e9f)), 0,
                                    1000000000);
        }
        changed_ = true;
    }

    void UseMaterial(const std::string& name) {
        const auto [it, is_new] =
            material_of_.emplace(name, static_cast<int>(document_.material_uses.size()));
        if (is_new) {
            Add({name, lines_.At(0)}, &document_.material_uses);
        }
        material_ = it->second;
        changed_ = true;
    }

    Lines lines_;
    Document& document_;
    Notes* notes_;
    ArrayRoom* room_;
    std::string object_, group_;
    int material_ = -1, smoothing_ = 0;
    bool changed_ = true;  // since the last part began
    Forward positions_, uvs_, normals_;
    std::unordered_map<std::string, int> material_of_;
};

}  // namespace

void ParseDocument(const FileSource& files, const std::string& name, Document* document,
                   Notes* notes, ArrayRoom* room) {
    document->names.push_back(name);
    const std::string bytes = files.Read(name);
    Parser(bytes, document, notes, room).Parse();
}

}  // namespace relume::obj
