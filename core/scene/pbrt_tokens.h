#pragma once

#include <deque>
#include <memory>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "core/scene/formats.h"
#include "core/scene/text_place.h"

namespace relume::pbrt {

using text::Fail;
using text::Notes;
using text::PathToName;
using text::Place;

struct Token {
    enum class Kind { kWord, kString, kOpen, kClose };
    Kind kind = Kind::kWord;
    std::string text;  // a string's without its quotes
    Place place;
};

// The words of a pbrt file and of those that it includes, in order. Bounded: 64 files deep, 100,000
// files and 4 GiB in all, and a file can't include itself.
class Tokens {
  public:
    // `files` must outlive it.
    Tokens(const FileSource& files, const std::string& main_name);

    std::optional<Token> Next();
    // The next one without taking it; null at the end.
    const Token* Peek();
    // Goes on with that file, relative to the main one's folder, and then here.
    void Include(const std::string& path, const Place& place);
    // How many files are open: 1 in the main one. Peek closes those that are at their end.
    std::size_t depth() const { return stack_.size(); }
    // Includes and the main file, in the order of their first use.
    const std::vector<std::string>& names() const { return names_; }
    Place place() const;  // of what comes next

  private:
    struct File {
        const std::string* name;
        std::string bytes;
        std::size_t at = 0, line_begin = 0;
        int line = 1;
    };
    void Push(const std::string& name);
    bool SkipBlanks(File* file);
    std::string ReadString(File* file, const Place& place);

    const FileSource& files_;
    std::deque<std::string> storage_;  // of the names, for Place
    std::vector<std::string> names_;
    std::vector<File> stack_;
    std::optional<Token> peeked_;
    std::size_t total_bytes_ = 0, total_files_ = 0;
};

}  // namespace relume::pbrt
