#include "core/scene/uri.h"

#include <fmt/format.h>

#include <algorithm>
#include <cctype>
#include <vector>

#include "core/base/error.h"
#include "core/scene/manifest.h"

namespace relume {
namespace {

int HexValue(char c) {
    if (c >= '0' && c <= '9') {
        return c - '0';
    }
    const char lower = static_cast<char>(c | 0x20);
    return lower >= 'a' && lower <= 'f' ? lower - 'a' + 10 : -1;
}

// A '%' that no two hex digits follow stays as it is: exporters forget to escape it.
std::string PercentDecode(std::string_view text) {
    std::string out;
    out.reserve(text.size());
    for (std::size_t i = 0; i < text.size(); ++i) {
        if (text[i] == '%' && i + 2 < text.size() && HexValue(text[i + 1]) >= 0 &&
            HexValue(text[i + 2]) >= 0) {
            out.push_back(static_cast<char>(HexValue(text[i + 1]) * 16 + HexValue(text[i + 2])));
            i += 2;
        } else {
            out.push_back(text[i]);
        }
    }
    return out;
}

int Base64Value(char c) {
    if (c >= 'A' && c <= 'Z') {
        return c - 'A';
    }
    if (c >= 'a' && c <= 'z') {
        return c - 'a' + 26;
    }
    if (c >= '0' && c <= '9') {
        return c - '0' + 52;
    }
    return c == '+' || c == '-' ? 62 : c == '/' || c == '_' ? 63 : -1;
}

std::string Base64Decode(std::string_view text, const SourceLocation& place) {
    while (!text.empty() && text.back() == '=') {
        text.remove_suffix(1);
    }
    std::string out;
    out.reserve(text.size() * 3 / 4);
    std::uint32_t bits = 0;
    int count = 0;
    for (const char c : text) {
        const int value = Base64Value(c);
        if (value < 0) {
            ThrowInvalidArgument(
                fmt::format("{}: its data URI is not base64; export the scene again", place));
        }
        bits = (bits << 6) | static_cast<std::uint32_t>(value);
        count += 6;
        if (count >= 8) {
            count -= 8;
            out.push_back(static_cast<char>((bits >> count) & 0xff));
        }
    }
    return out;
}

bool HasScheme(std::string_view uri) {
    const auto end = uri.find_first_of(":/?#");
    return end != std::string_view::npos && end > 0 && uri[end] == ':' &&
           std::isalpha(static_cast<unsigned char>(uri[0])) != 0;
}

}  // namespace

bool IsDataUri(std::string_view uri) { return uri.substr(0, 5) == "data:"; }

std::string DecodeDataUri(std::string_view uri, const SourceLocation& place) {
    const auto comma = uri.find(',');
    if (comma == std::string_view::npos) {
        ThrowInvalidArgument(fmt::format(
            "{}: its data URI has no comma before the data; export the scene again", place));
    }
    const std::string_view head = uri.substr(0, comma);
    const std::string_view body = uri.substr(comma + 1);
    const bool base64 = head.size() >= 7 && head.substr(head.size() - 7) == ";base64";
    return base64 ? Base64Decode(body, place) : PercentDecode(body);
}

std::optional<std::string> CollapseDots(const std::string& path) {
    if (path.empty() || path.front() == '/') {
        return std::nullopt;
    }
    std::vector<std::string> parts;
    for (std::size_t begin = 0; begin <= path.size();) {
        const std::size_t end = std::min(path.find('/', begin), path.size());
        const std::string part = path.substr(begin, end - begin);
        if (part == "..") {
            if (parts.empty()) {
                return std::nullopt;
            }
            parts.pop_back();
        } else if (part != ".") {
            parts.push_back(part);
        }
        begin = end + 1;
    }
    const std::string collapsed = fmt::format("{}", fmt::join(parts, "/"));
    if (collapsed.empty() || collapsed.front() == '/') {  // "./", ".//a"
        return std::nullopt;
    }
    return collapsed;
}

std::string UriToName(std::string_view uri, const SourceLocation& place) {
    if (HasScheme(uri)) {
        ThrowInvalidArgument(
            fmt::format("{}: '{}' is not a file of the scene; put the file into the scene's folder "
                        "and refer to it "
                        "by a relative path",
                        place, Printable(std::string(uri))));
    }
    const std::string path = PercentDecode(uri);
    const std::optional<std::string> name = CollapseDots(path);
    if (!name || !IsSafeRelativePath(*name)) {
        ThrowInvalidArgument(
            fmt::format("{}: the path '{}' must be relative, with forward slashes, and stay below "
                        "the scene's folder",
                        place, Printable(path)));
    }
    return *name;
}

}  // namespace relume
