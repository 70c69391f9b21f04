#include "core/scene/pbrt_tokens.h"

#include <fmt/format.h>

#include <algorithm>
#include <utility>

#include "core/base/error.h"

namespace relume::pbrt {
namespace {

constexpr std::size_t kMaxDepth = 64, kMaxFiles = 100000, kMaxBytes = std::size_t{1} << 32;

bool IsBlank(char c) { return c == ' ' || c == '\t' || c == '\r' || c == '\n'; }
bool EndsWord(char c) { return IsBlank(c) || c == '"' || c == '[' || c == ']' || c == '#'; }

}  // namespace

Tokens::Tokens(const FileSource& files, const std::string& main_name) : files_(files) {
    Push(main_name);
}

void Tokens::Push(const std::string& name) {
    File file;
    file.bytes = files_.Read(name);
    auto known = std::find(storage_.begin(), storage_.end(), name);
    if (known == storage_.end()) {
        storage_.push_back(name);
        names_.push_back(name);
        known = storage_.end() - 1;
    }
    file.name = &*known;
    total_bytes_ += file.bytes.size();
    ++total_files_;
    stack_.push_back(std::move(file));
}

void Tokens::Include(const std::string& path, const Place& place) {
    const std::string name = PathToName(path, place);
    for (const File& file : stack_) {
        if (*file.name == name) {
            Fail(place, fmt::format("'{}' includes itself; remove the Include", name));
        }
    }
    if (stack_.size() >= kMaxDepth || total_files_ >= kMaxFiles || total_bytes_ >= kMaxBytes) {
        Fail(place, fmt::format("too many files are included (at most {} deep, {} in all, 4 GiB); "
                                "join some of them",
                                kMaxDepth, kMaxFiles));
    }
    try {
        Push(name);
    } catch (const Error& error) {
        throw Error(error.code(), fmt::format("{}: {}", place.Text(), error.what()));
    }
}

bool Tokens::SkipBlanks(File* file) {
    while (file->at < file->bytes.size()) {
        const char c = file->bytes[file->at];
        if (c == '#') {
            file->at = std::min(file->bytes.find('\n', file->at), file->bytes.size());
        } else if (IsBlank(c)) {
            ++file->at;
            if (c == '\n') {
                ++file->line;
                file->line_begin = file->at;
            }
        } else {
            return true;
        }
    }
    return false;
}

Place Tokens::place() const {
    if (peeked_) {
        return peeked_->place;
    }
    if (stack_.empty()) {
        return {storage_.empty() ? nullptr : &storage_.front(), 0, 0};
    }
    const File& file = stack_.back();
    return {file.name, file.line, static_cast<int>(file.at - file.line_begin) + 1};
}

// pbrt knows the escapes of C for newline, tab, quote, backslash and the like; the rest of a string
// is taken as it is.
std::string Tokens::ReadString(File* file, const Place& place) {
    std::string text;
    for (++file->at; file->at < file->bytes.size(); ++file->at) {
        char c = file->bytes[file->at];
        if (c == '"') {
            ++file->at;
            return text;
        }
        if (c == '\n') {
            break;
        }
        if (c == '\\' && file->at + 1 < file->bytes.size()) {
            constexpr std::string_view kEscapes = "bfnrt\\'\"", kMeanings = "\b\f\n\r\t\\'\"";
            const auto escape = kEscapes.find(file->bytes[file->at + 1]);
            if (escape != std::string_view::npos) {
                c = kMeanings[escape];
                ++file->at;
            }
        }
        text.push_back(c);
    }
    Fail(place, "this string has no closing quote on its line; add it");
}

std::optional<Token> Tokens::Next() {
    if (peeked_) {
        std::optional<Token> token = std::move(peeked_);
        peeked_.reset();
        return token;
    }
    while (!stack_.empty() && !SkipBlanks(&stack_.back())) {
        stack_.pop_back();
    }
    if (stack_.empty()) {
        return std::nullopt;
    }
    Token token;
    token.place = place();
    File& file = stack_.back();
    const char c = file.bytes[file.at];
    if (c == '"') {
        token.kind = Token::Kind::kString;
        token.text = ReadString(&file, token.place);
    } else if (c == '[' || c == ']') {
        token.kind = c == '[' ? Token::Kind::kOpen : Token::Kind::kClose;
        token.text = c;
        ++file.at;
    } else {
        const std::size_t begin = file.at;
        while (file.at < file.bytes.size() && !EndsWord(file.bytes[file.at])) {
            ++file.at;
        }
        token.text = file.bytes.substr(begin, file.at - begin);
    }
    return token;
}

const Token* Tokens::Peek() {
    if (!peeked_) {
        peeked_ = Next();
    }
    return peeked_ ? &*peeked_ : nullptr;
}

}  // namespace relume::pbrt
