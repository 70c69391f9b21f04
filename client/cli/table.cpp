#include "client/cli/table.h"

#include <fmt/format.h>

#include <algorithm>
#include <cctype>

namespace relume::client {
namespace {

bool LooksLikeNumber(const std::string& cell) {
    const std::size_t first = cell.find_first_not_of("+-");
    return first != std::string::npos && std::isdigit(static_cast<unsigned char>(cell[first])) &&
           cell.find(' ') == std::string::npos && cell.find('/') == std::string::npos;
}

}  // namespace

std::string FormatTable(const std::vector<std::vector<std::string>>& rows) {
    std::vector<std::size_t> widths;
    std::vector<bool> numbers;
    for (std::size_t r = 0; r < rows.size(); ++r) {
        widths.resize(std::max(widths.size(), rows[r].size()), 0);
        numbers.resize(widths.size(), rows.size() > 1);
        for (std::size_t c = 0; c < rows[r].size(); ++c) {
            widths[c] = std::max(widths[c], rows[r][c].size());
            numbers[c] = numbers[c] && (r == 0 || LooksLikeNumber(rows[r][c]));
        }
    }
    std::string text;
    for (const auto& row : rows) {
        std::string line;
        for (std::size_t c = 0; c < row.size(); ++c) {
            line += numbers[c] ? fmt::format("{:>{}}", row[c], widths[c])
                               : fmt::format("{:<{}}", row[c], widths[c]);
            line += c + 1 < row.size() ? "  " : "";
        }
        line.erase(line.find_last_not_of(' ') + 1);
        text += line + "\n";
    }
    return text;
}

}  // namespace relume::client
