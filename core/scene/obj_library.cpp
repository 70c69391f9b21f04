#include <fmt/format.h>

#include <algorithm>
#include <set>
#include <utility>

#include "core/base/error.h"
#include "core/scene/obj.h"

// MTL: https://paulbourke.net/dataformats/mtl/, and the extension for physically based materials
// that exporters share (Pr Pm Ps Pc Pcr, norm, map_Ke).

namespace relume::obj {
namespace {

constexpr std::string_view kColors[] = {"Kd", "Ks", "Ke", "Tf", "Kt"};
constexpr std::string_view kNumbers[] = {"Ns", "Ni", "d",  "Tr", "illum",
                                         "Pr", "Pm", "Ps", "Pc", "Pcr"};
// What a statement that names a picture is called in MtlMaterial::maps.
constexpr std::pair<std::string_view, std::string_view> kMaps[] = {
    {"map_Kd", "map_Kd"}, {"map_Ks", "map_Ks"},  {"map_Ke", "map_Ke"}, {"map_d", "map_d"},
    {"map_Tr", "map_Tr"}, {"bump", "bump"},      {"map_bump", "bump"}, {"map_Bump", "bump"},
    {"map_BUMP", "bump"}, {"norm", "norm"},      {"map_norm", "norm"}, {"map_Norm", "norm"},
    {"map_Kn", "norm"},   {"map_Pr", "map_Pr"},  {"map_Pm", "map_Pm"}, {"map_Ps", "map_Ps"},
    {"map_Pc", "map_Pc"}, {"map_Pcr", "map_Pcr"}};
// Of lighting that path tracing makes itself, or of how others draw.
constexpr std::string_view kWithoutMeaning[] = {"Ka", "map_Ka", "Km", "sharpness", "map_aat"};

template <class T, std::size_t N>
bool IsOneOf(std::string_view word, const T (&list)[N]) {
    return std::find(std::begin(list), std::end(list), word) != std::end(list);
}

// Paths of an MTL file are relative to its folder.
std::string NameBeside(const std::string& file, const std::string& path, const Place& place) {
    const std::size_t slash = file.rfind('/');
    return PathToName(slash == std::string::npos ? path : file.substr(0, slash + 1) + path, place);
}

class Parser {
  public:
    Parser(const std::string* name, std::string_view bytes, std::vector<MtlMaterial>* materials,
           Notes* notes)
        : name_(*name), lines_(name, bytes), materials_(*materials), notes_(notes) {}

    void Parse() {
        while (lines_.Next()) {
            const std::string word(lines_.words().front());
            if (word == "newmtl") {
                MtlMaterial material;
                material.name = lines_.Rest(1);
                material.place = lines_.At(0);
                materials_.push_back(std::move(material));
                begun_ = true;
            } else if (!begun_) {
                Fail(lines_.At(0), fmt::format("'{}' stands before the first newmtl; repair the "
                                               "file",
                                               word.substr(0, 32)));
            } else {
                Statement(word);
            }
        }
    }

  private:
    void Statement(const std::string& word) {
        MtlMaterial& material = materials_.back();
        const auto* const map =
            std::find_if(std::begin(kMaps), std::end(kMaps),
                         [&](const auto& entry) { return entry.first == word; });
        if (map != std::end(kMaps)) {
            if (std::optional<Map> read = ReadMap()) {
                material.maps[std::string(map->second)] = std::move(*read);
            }
        } else if (IsOneOf(word, kColors)) {
            ReadColor(word == "Kt" ? "Tf" : word, &material);
        } else if (IsOneOf(word, kNumbers)) {
            std::size_t at = 1;
            if (word == "d" && lines_.words().size() > 2 && lines_.words()[1] == "-halo") {
                notes_->Add(lines_.At(1), "'d -halo' is taken as plain 'd'");
                at = 2;
            }
            const float number = lines_.Number(at);
            if (number < 0) {
                Fail(lines_.At(at), fmt::format("'{}' can't be negative; correct the line", word));
            }
            if (word == "Tr") {  // transparency: what d leaves
                material.numbers.try_emplace("d", 1 - std::min(number, 1.0f));
            } else {
                material.numbers[word] = number;
            }
        } else if (!IsOneOf(word, kWithoutMeaning)) {
            notes_->Add(lines_.At(0), fmt::format("'{}' of materials is not supported, and ignored",
                                                  word.substr(0, 32)));
        }
    }

    // "Kd r g b" or "Kd grey".
    void ReadColor(const std::string& word, MtlMaterial* material) {
        const auto& words = lines_.words();
        if (words.size() > 1 && (words[1] == "spectral" || words[1] == "xyz")) {
            notes_->Add(lines_.At(1),
                        fmt::format("colours as '{}' are not supported, and ignored", words[1]));
            return;
        }
        Rgb color = Rgb{1, 1, 1} * lines_.Number(1);
        if (words.size() > 2) {
            color = {color.x, lines_.Number(2), lines_.Number(3)};
        }
        if (color.x < 0 || color.y < 0 || color.z < 0) {
            Fail(lines_.At(1), fmt::format("'{}' can't be negative; correct the line", word));
        }
        material->colors[word] = color;
    }

    // Options, then a path that may have blanks in it.
    std::optional<Map> ReadMap() {
        const auto& words = lines_.words();
        Map map;
        map.place = lines_.At(0);
        std::size_t at = 1;
        while (at + 1 < words.size() && words[at].size() > 1 && words[at].front() == '-') {
            const std::string option(words[at]);
            const auto numbers = [&](std::size_t most) {
                std::vector<float> values;
                while (values.size() < most && at + 1 < words.size() && IsNumber(words[at + 1])) {
                    values.push_back(lines_.Number(++at));
                }
                return values;
            };
            if (option == "-s" || option == "-o") {
                const std::vector<float> values = numbers(3);
                Vec2f& pair = option == "-s" ? map.scale : map.offset;
                pair.x = values.empty() ? pair.x : values[0];
                pair.y = values.size() < 2 ? pair.y : values[1];
            } else if (option == "-bm") {
                const std::vector<float> values = numbers(1);
                map.bump = values.empty() ? 1 : values[0];
            } else if (option == "-clamp") {
                map.clamp = words[++at] == "on";
            } else if (option == "-imfchan") {
                map.channel = words[++at].front();
            } else if (option == "-blendu" || option == "-blendv" || option == "-cc" ||
                       option == "-texres" || option == "-boost" || option == "-type" ||
                       option == "-colorspace") {
                ++at;  // of filtering, or said by the statement
            } else {
                notes_->Add(lines_.At(at), fmt::format("the option '{}' of pictures is not "
                                                       "supported, and ignored",
                                                       option.substr(0, 32)));
                numbers(3);
            }
            ++at;
        }
        const std::string path = lines_.Rest(at);
        if (path.empty()) {
            notes_->Add(map.place, fmt::format("'{}' names no picture, and is ignored", words[0]));
            return std::nullopt;
        }
        map.name = NameBeside(name_, path, map.place);
        return map;
    }

    static bool IsNumber(std::string_view word) {
        return !word.empty() && word.find_first_not_of("+-.0123456789eE") == std::string_view::npos;
    }

    const std::string& name_;
    Lines lines_;
    std::vector<MtlMaterial>& materials_;
    Notes* notes_;
    bool begun_ = false;
};

// The bytes, or nothing if there is no such file.
std::optional<std::string> TryRead(const FileSource& files, const std::string& name) {
    try {
        return files.Read(name);
    } catch (const Error& error) {
        if (error.code() != ErrorCode::kNotFound) {
            throw;
        }
        return std::nullopt;
    }
}

}  // namespace

void ParseLibrary(const std::string* name, std::string_view bytes,
                  std::vector<MtlMaterial>* materials, Notes* notes) {
    Parser(name, bytes, materials, notes).Parse();
}

std::vector<MtlMaterial> ReadLibraries(const FileSource& files, Document* document,
                                       std::vector<std::string>* names, Notes* notes) {
    std::vector<MtlMaterial> materials;
    std::set<std::string> known;
    const auto read = [&](const std::string& path, const Place& place) {
        const std::string name = PathToName(path, place);
        if (known.count(name) != 0) {
            return true;
        }
        const std::optional<std::string> bytes = TryRead(files, name);
        if (bytes) {
            known.insert(name);
            names->push_back(name);
            document->names.push_back(name);
            ParseLibrary(&document->names.back(), *bytes, &materials, notes);
        }
        return bytes.has_value();
    };
    const auto note = [&](const std::string& path, const Place& place) {
        notes->Add(place, fmt::format("the material library '{}' is missing: its materials are "
                                      "replaced by the default; restore the file",
                                      path));
    };
    for (const Document::Named& library : document->libraries) {
        // One name with blanks in it, or several names.
        if (library.name.empty() || read(library.name, library.place)) {
            continue;
        }
        if (library.name.find(' ') == std::string::npos) {
            note(library.name, library.place);
            continue;
        }
        for (std::size_t begin = 0; begin < library.name.size();) {
            const std::size_t end = std::min(library.name.find(' ', begin), library.name.size());
            const std::string part = library.name.substr(begin, end - begin);
            if (!part.empty() && !read(part, library.place)) {
                note(part, library.place);
            }
            begin = end + 1;
        }
    }
    return materials;
}

}  // namespace relume::obj
