#include "core/scene/text_place.h"

#include <fmt/format.h>

#include <algorithm>
#include <optional>

#include "core/base/error.h"
#include "core/scene/manifest.h"
#include "core/scene/uri.h"

namespace relume::text {
namespace {

constexpr std::size_t kMaxNotes = 1000;

}  // namespace

SourceLocation Place::Text() const {
    return file == nullptr ? "scene" : fmt::format("{}:{}:{}", *file, line, column);
}

void Fail(const Place& place, const std::string& problem) {
    ThrowInvalidArgument(fmt::format("{}: {}", place.Text(), problem));
}

void Notes::Add(const Place& place, const std::string& message) {
    for (const auto& note : notes_) {
        if (note.second == message) {
            return;
        }
    }
    if (notes_.size() < kMaxNotes) {
        notes_.emplace_back(
            place.file == nullptr ? "" : fmt::format("{}:{}: ", *place.file, place.line), message);
    }
}

void Notes::Merge(const Notes& other) {
    for (const auto& note : other.notes_) {
        bool known = false;
        for (const auto& mine : notes_) {
            known = known || mine.second == note.second;
        }
        if (!known && notes_.size() < kMaxNotes) {
            notes_.push_back(note);
        }
    }
}

std::vector<std::string> Notes::Take() const {
    std::vector<std::string> texts;
    for (const auto& note : notes_) {
        texts.push_back(note.first + note.second);
    }
    return texts;
}

std::string PathToName(const std::string& path, const Place& place) {
    std::string slashed = path;
    std::replace(slashed.begin(), slashed.end(), '\\', '/');
    // Slashes that repeat or end a path say nothing here, as to a file system.
    const auto repeats = [](char a, char b) { return a == '/' && b == '/'; };
    slashed.erase(std::unique(slashed.begin(), slashed.end(), repeats), slashed.end());
    if (slashed.size() > 1 && slashed.back() == '/') {
        slashed.pop_back();
    }
    const std::optional<std::string> name = CollapseDots(slashed);
    if (!name || !IsSafeRelativePath(*name)) {
        Fail(place, fmt::format("the path '{}' must be relative and stay below the scene's folder; "
                                "move the file there",
                                path));
    }
    return *name;
}

}  // namespace relume::text
