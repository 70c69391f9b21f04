#pragma once

#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "core/math/vec.h"
#include "core/scene/array_room.h"
#include "core/scene/pbrt_tokens.h"

namespace relume::pbrt {

// One parameter, "type name" [ values ].
struct Param {
    std::string type, name;
    std::vector<float> numbers;        // all numeric types but integer
    std::vector<int> integers;         // type integer
    std::vector<std::string> strings;  // string, texture, spectrum by name; bool: "true", "false"
    Place place;
    bool is_default = false;  // from an Attribute directive
    mutable bool used = false;
};

// A parameter list. Every getter marks what it gives as used; what is left is unknown.
class Params {
  public:
    // Reads parameters up to the next directive.
    static Params Parse(Tokens* tokens, ArrayRoom* room);

    void Append(const Params& defaults);  // of an Attribute directive; own values win
    const std::vector<Param>& all() const { return params_; }
    std::uint64_t bytes() const;  // that the values take

    // First one of that name and one of these types ("float point3"); null if there is none.
    const Param* Find(std::string_view name, std::string_view types) const;
    bool Has(std::string_view name) const;  // of any type; does not mark it

    // The default if absent; a wrong number of values throws.
    float Float(std::string_view name, float otherwise) const;
    int Int(std::string_view name, int otherwise) const;
    bool Bool(std::string_view name, bool otherwise) const;
    std::string String(std::string_view name, const std::string& otherwise) const;
    Vec3f Point(std::string_view name, Vec3f otherwise) const;  // or vector, normal
    std::vector<float> Floats(std::string_view name) const;     // empty if absent
    std::vector<int> Ints(std::string_view name) const;
    std::vector<Vec3f> Points(std::string_view name) const;
    std::vector<Vec2f> Points2(std::string_view name) const;
    std::vector<std::string> Strings(std::string_view name) const;

    void Ignore(std::string_view names) const;  // known, and without meaning here
    // Notes the parameters of `owner` that nobody asked for.
    void NoteUnused(const std::string& owner, Notes* notes) const;

  private:
    std::vector<Param> params_;
};

// The number that a word spells; throws naming what was `wanted` if there is none.
double ParseNumber(const Token& token, const char* wanted);

}  // namespace relume::pbrt
