#include "core/base/param_set.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <charconv>
#include <cmath>
#include <optional>

#include "core/base/error.h"

namespace relume {
namespace {

[[noreturn]] void ThrowKind(const std::string& name, const std::string& wanted) {
    ThrowInvalidArgument(fmt::format("parameter '{}' must be {}", name, wanted));
}

std::optional<float> ToFloat(const std::string& text) {
    float value = 0;
    const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), value);
    if (error != std::errc() || end != text.data() + text.size()) {
        return std::nullopt;
    }
    return value;
}

}  // namespace

const ParamSet::Value* ParamSet::Find(const std::string& name) const {
    asked_.insert(name);
    const auto it = values_.find(name);
    return it == values_.end() ? nullptr : &it->second;
}

bool ParamSet::GetBool(const std::string& name, bool otherwise) const {
    const Value* v = Find(name);
    if (v == nullptr) {
        return otherwise;
    }
    if (const auto* b = std::get_if<bool>(v)) {
        return *b;
    }
    if (const auto* s = std::get_if<std::string>(v)) {
        if (*s == "true" || *s == "on" || *s == "1") {
            return true;
        }
        if (*s == "false" || *s == "off" || *s == "0") {
            return false;
        }
    }
    ThrowKind(name, "true or false");
}

float ParamSet::GetFloat(const std::string& name, float otherwise) const {
    const Value* v = Find(name);
    if (v == nullptr) {
        return otherwise;
    }
    if (const auto* f = std::get_if<std::vector<float>>(v); f != nullptr && f->size() == 1) {
        return f->front();
    }
    if (const auto* s = std::get_if<std::string>(v)) {
        if (const auto number = ToFloat(*s); number && std::isfinite(*number)) {
            return *number;
        }
    }
    ThrowKind(name, "one number");
}

int ParamSet::GetInt(const std::string& name, int otherwise) const {
    const float value = GetFloat(name, static_cast<float>(otherwise));
    if (value != std::floor(value) || std::abs(value) > 1e6f) {
        ThrowKind(name, "a whole number");
    }
    return static_cast<int>(value);
}

std::string ParamSet::GetString(const std::string& name, const std::string& otherwise) const {
    const Value* v = Find(name);
    if (v == nullptr) {
        return otherwise;
    }
    if (const auto* s = std::get_if<std::string>(v)) {
        return *s;
    }
    ThrowKind(name, "a text");
}

std::vector<float> ParamSet::GetFloats(const std::string& name,
                                       const std::vector<float>& otherwise) const {
    const Value* v = Find(name);
    if (v == nullptr) {
        return otherwise;
    }
    if (const auto* f = std::get_if<std::vector<float>>(v);
        f != nullptr && (otherwise.empty() || f->size() == otherwise.size())) {
        return *f;
    }
    if (std::holds_alternative<std::string>(*v) && otherwise.size() <= 1) {
        return {GetFloat(name, 0)};
    }
    ThrowKind(name, otherwise.empty()       ? "a list of numbers"
                    : otherwise.size() == 1 ? "one number"
                                            : fmt::format("{} numbers", otherwise.size()));
}

std::string ParamSet::GetChoice(const std::string& name, const std::string& otherwise,
                                const std::vector<std::string>& known) const {
    const std::string value = GetString(name, otherwise);
    for (const auto& k : known) {
        if (value == k) {
            return value;
        }
    }
    ThrowInvalidArgument(
        fmt::format("{}={}: unknown; known: {}", name, value, fmt::join(known, ", ")));
}

std::vector<std::string> ParamSet::Unused() const {
    std::vector<std::string> unused;
    for (const auto& [name, value] : values_) {
        if (asked_.count(name) == 0) {
            unused.push_back(name);
        }
    }
    return unused;
}

void ParamSet::RejectUnused(const std::string& owner) const {
    const auto unused = Unused();
    if (unused.empty()) {
        return;
    }
    ThrowInvalidArgument(
        fmt::format("{}: unknown parameter '{}'; known: {}", owner, unused.front(),
                    asked_.empty() ? "none" : fmt::format("{}", fmt::join(asked_, ", "))));
}

NamedParams ParseNamedParams(std::string_view text) {
    NamedParams result;
    const auto colon = text.find(':');
    result.name = std::string(text.substr(0, colon));
    while (colon != std::string_view::npos && text.size() > colon + 1) {
        std::string_view rest = text.substr(colon + 1);
        while (!rest.empty()) {
            const auto comma = rest.find(',');
            const std::string_view item = rest.substr(0, comma);
            const auto equals = item.find('=');
            if (equals == std::string_view::npos || equals == 0) {
                ThrowInvalidArgument(
                    fmt::format("'{}': '{}' is not of the form key=value", text, item));
            }
            result.params.Set(std::string(item.substr(0, equals)),
                              std::string(item.substr(equals + 1)));
            rest = comma == std::string_view::npos ? std::string_view() : rest.substr(comma + 1);
        }
        break;
    }
    return result;
}

}  // namespace relume
