#include "core/scene/pbrt_params.h"

#include <fmt/format.h>

#include <charconv>
#include <cmath>
#include <limits>
#include <utility>

namespace relume::pbrt {
namespace {

bool IsOneOf(std::string_view word, std::string_view list) {
    for (std::size_t begin = 0; begin < list.size();) {
        const std::size_t end = std::min(list.find(' ', begin), list.size());
        if (list.substr(begin, end - begin) == word) {
            return true;
        }
        begin = end + 1;
    }
    return false;
}

constexpr std::string_view kNumberTypes =
    "float point point2 point3 vector vector2 vector3 normal normal3 rgb color xyz blackbody";
constexpr std::string_view kTextTypes = "string texture";

// "float  fov" has a type and a name.
Param ParseHead(const Token& token) {
    Param param;
    param.place = token.place;
    const std::string& text = token.text;
    const auto type_begin = text.find_first_not_of(" \t");
    const auto type_end = text.find_first_of(" \t", std::min(type_begin, text.size()));
    const auto name_begin = text.find_first_not_of(" \t", std::min(type_end, text.size()));
    if (name_begin == std::string::npos) {
        Fail(token.place,
             fmt::format("a parameter must be declared as \"type name\", not as \"{}\"", text));
    }
    const auto name_end = std::min(text.find_first_of(" \t", name_begin), text.size());
    param.type = text.substr(type_begin, type_end - type_begin);
    param.name = text.substr(name_begin, name_end - name_begin);
    return param;
}

// Counts what the array grows by.
template <class T>
void Append(T value, const Token& token, std::vector<T>* to, ArrayRoom* room) {
    room->ForOneMore(*to, [&] { return token.place.Text(); });
    to->push_back(std::move(value));
}

void AddValue(const Token& token, Param* param, ArrayRoom* room) {
    const bool is_string = token.kind == Token::Kind::kString;
    if (param->type == "integer") {
        if (is_string) {
            Fail(token.place, fmt::format("'{}' takes whole numbers", param->name));
        }
        const double value = ParseNumber(token, "a whole number");
        if (std::abs(value) > std::numeric_limits<int>::max()) {
            Fail(token.place, fmt::format("'{}' does not fit 32 bits", token.text));
        }
        Append(static_cast<int>(value), token, &param->integers, room);
    } else if (param->type == "bool") {
        if (token.text != "true" && token.text != "false") {
            Fail(token.place,
                 fmt::format("'{}' takes true or false, not '{}'", param->name, token.text));
        }
        Append(token.text, token, &param->strings, room);
    } else if (IsOneOf(param->type, kTextTypes) || (param->type == "spectrum" && is_string)) {
        if (!is_string) {
            Fail(token.place, fmt::format("'{}' takes a string in quotes", param->name));
        }
        Append(token.text, token, &param->strings, room);
    } else if (param->type == "spectrum" || IsOneOf(param->type, kNumberTypes)) {
        if (is_string) {
            Fail(token.place, fmt::format("'{}' takes numbers, not strings", param->name));
        }
        Append(static_cast<float>(ParseNumber(token, "a number")), token, &param->numbers, room);
    } else {
        Fail(param->place, fmt::format("the parameter type '{}' is not known; known: integer bool "
                                       "string texture spectrum {}",
                                       param->type, kNumberTypes));
    }
}

void ParseValues(Tokens* tokens, Param* param, ArrayRoom* room) {
    std::optional<Token> token = tokens->Next();
    if (!token || token->kind == Token::Kind::kClose) {
        Fail(param->place, fmt::format("the parameter '{}' has no value", param->name));
    }
    if (token->kind != Token::Kind::kOpen) {
        AddValue(*token, param, room);
        return;
    }
    const Place opened = token->place;
    for (token = tokens->Next(); token && token->kind != Token::Kind::kClose;
         token = tokens->Next()) {
        if (token->kind == Token::Kind::kOpen) {
            Fail(token->place, "brackets can't be nested");
        }
        AddValue(*token, param, room);
    }
    if (!token) {
        Fail(opened, "this bracket is not closed; add a ']'");
    }
}

[[noreturn]] void FailCount(const Param& param, const char* wanted) {
    Fail(param.place, fmt::format("'{}' must have {}", param.name, wanted));
}

const std::vector<float> kNoFloats;

}  // namespace

double ParseNumber(const Token& token, const char* wanted) {
    const char* begin = token.text.data();
    const char* const end = begin + token.text.size();
    if (begin != end && *begin == '+') {
        ++begin;
    }
    double value = 0;
    const auto [rest, error] = std::from_chars(begin, end, value);
    if (token.kind != Token::Kind::kWord || rest != end || error == std::errc::invalid_argument) {
        Fail(token.place, fmt::format("expected {}, found '{}'", wanted, token.text));
    }
    if (error == std::errc::result_out_of_range) {
        // Too small for a double is 0; too large is not a number to render with.
        const auto exponent = token.text.find_first_of("eE");
        if (exponent == std::string::npos || token.text.find('-', exponent) == std::string::npos) {
            Fail(token.place, fmt::format("the number '{}' is too large", token.text));
        }
        return 0;
    }
    if (!std::isfinite(value) || std::abs(value) > std::numeric_limits<float>::max()) {
        Fail(token.place, fmt::format("the number '{}' is not finite in single precision; repair "
                                      "the file",
                                      token.text));
    }
    return value;
}

Params Params::Parse(Tokens* tokens, ArrayRoom* room) {
    Params params;
    for (const Token* next = tokens->Peek(); next != nullptr && next->kind == Token::Kind::kString;
         next = tokens->Peek()) {
        Param param = ParseHead(*next);
        tokens->Next();
        ParseValues(tokens, &param, room);
        room->ForOneMore(params.params_, [&] { return param.place.Text(); });
        params.params_.push_back(std::move(param));
    }
    return params;
}

std::uint64_t Params::bytes() const {
    std::uint64_t sum = 0;
    for (const Param& param : params_) {
        sum += sizeof(Param) + param.numbers.size() * sizeof(float) +
               param.integers.size() * sizeof(int) + param.strings.size() * sizeof(std::string);
    }
    return sum;
}

void Params::Append(const Params& defaults) {
    for (Param param : defaults.params_) {
        param.is_default = true;
        params_.push_back(std::move(param));
    }
}

const Param* Params::Find(std::string_view name, std::string_view types) const {
    for (const Param& param : params_) {
        if (param.name == name && IsOneOf(param.type, types)) {
            param.used = true;
            return &param;
        }
    }
    return nullptr;
}

bool Params::Has(std::string_view name) const {
    for (const Param& param : params_) {
        if (param.name == name) {
            return true;
        }
    }
    return false;
}

float Params::Float(std::string_view name, float otherwise) const {
    if (const Param* param = Find(name, "float")) {
        if (param->numbers.size() != 1) {
            FailCount(*param, "one number");
        }
        return param->numbers[0];
    }
    const Param* param = Find(name, "integer");
    if (param != nullptr && param->integers.size() != 1) {
        FailCount(*param, "one number");
    }
    return param == nullptr ? otherwise : static_cast<float>(param->integers[0]);
}

int Params::Int(std::string_view name, int otherwise) const {
    const Param* param = Find(name, "integer");
    if (param != nullptr && param->integers.size() != 1) {
        FailCount(*param, "one whole number");
    }
    return param == nullptr ? otherwise : param->integers[0];
}

bool Params::Bool(std::string_view name, bool otherwise) const {
    const Param* param = Find(name, "bool");
    if (param != nullptr && param->strings.size() != 1) {
        FailCount(*param, "one value, true or false");
    }
    return param == nullptr ? otherwise : param->strings[0] == "true";
}

std::string Params::String(std::string_view name, const std::string& otherwise) const {
    const Param* param = Find(name, "string");
    if (param != nullptr && param->strings.size() != 1) {
        FailCount(*param, "one string");
    }
    return param == nullptr ? otherwise : param->strings[0];
}

Vec3f Params::Point(std::string_view name, Vec3f otherwise) const {
    const Param* param = Find(name, "point point3 vector vector3 normal normal3");
    if (param != nullptr && param->numbers.size() != 3) {
        FailCount(*param, "3 numbers");
    }
    return param == nullptr ? otherwise
                            : Vec3f{param->numbers[0], param->numbers[1], param->numbers[2]};
}

std::vector<float> Params::Floats(std::string_view name) const {
    const Param* param = Find(name, "float");
    return param == nullptr ? kNoFloats : param->numbers;
}

std::vector<int> Params::Ints(std::string_view name) const {
    const Param* param = Find(name, "integer");
    return param == nullptr ? std::vector<int>() : param->integers;
}

std::vector<Vec3f> Params::Points(std::string_view name) const {
    std::vector<Vec3f> points;
    if (const Param* param = Find(name, "point point3 vector vector3 normal normal3")) {
        const std::vector<float>& n = param->numbers;
        if (n.size() % 3 != 0) {
            FailCount(*param, "3 numbers a vertex");
        }
        points.reserve(n.size() / 3);
        for (std::size_t i = 0; i < n.size(); i += 3) {
            points.push_back({n[i], n[i + 1], n[i + 2]});
        }
    }
    return points;
}

std::vector<Vec2f> Params::Points2(std::string_view name) const {
    std::vector<Vec2f> points;
    if (const Param* param = Find(name, "point2 float vector2 point")) {
        const std::vector<float>& n = param->numbers;
        if (n.size() % 2 != 0) {
            FailCount(*param, "2 numbers a vertex");
        }
        points.reserve(n.size() / 2);
        for (std::size_t i = 0; i < n.size(); i += 2) {
            points.push_back({n[i], n[i + 1]});
        }
    }
    return points;
}

std::vector<std::string> Params::Strings(std::string_view name) const {
    const Param* param = Find(name, "string");
    return param == nullptr ? std::vector<std::string>() : param->strings;
}

void Params::Ignore(std::string_view names) const {
    for (const Param& param : params_) {
        if (IsOneOf(param.name, names)) {
            param.used = true;
        }
    }
}

void Params::NoteUnused(const std::string& owner, Notes* notes) const {
    for (const Param& param : params_) {
        if (!param.used && !param.is_default) {
            notes->Add(param.place, fmt::format("{}: the parameter \"{} {}\" is not supported, and "
                                                "ignored",
                                                owner, param.type, param.name));
        }
    }
}

}  // namespace relume::pbrt
