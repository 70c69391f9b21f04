#pragma once

#include <fmt/format.h>

#include <string>

#include "core/base/error.h"
#include "core/base/param_set.h"

namespace relume::render {

// What the registries of materials, lights and cameras share: finds the entry of `thing.type` in a
// table of types, and answers with make(entry, params). `kind` is for messages. Throws Error that
// names where `thing` is from: an unknown type (with the known ones), a parameter that `make` did
// not ask for, or what `make` threw.
template <class Thing, class Entries, class Make>
auto CompileByType(const char* kind, const Thing& thing, const Entries& entries, Make make) {
    const std::string owner =
        thing.source.empty() ? fmt::format("{} '{}'", kind, thing.name) : thing.source;
    std::string known;
    for (const auto& entry : entries) {
        if (thing.type == entry.type) {
            try {
                const ParamSet params = thing.params;  // reading marks: scenes are shared
                const auto compiled = make(entry, params);
                params.RejectUnused(fmt::format("{} type '{}'", kind, thing.type));
                return compiled;
            } catch (const Error& error) {
                throw Error(error.code(), fmt::format("{}: {}", owner, error.what()));
            }
        }
        known += fmt::format("{}{}", known.empty() ? "" : ", ", entry.type);
    }
    ThrowInvalidArgument(
        fmt::format("{}: unknown {} type '{}'; known are {}", owner, kind, thing.type, known));
}

}  // namespace relume::render
