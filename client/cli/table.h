#pragma once

#include <string>
#include <vector>

namespace relume::client {

// Rows of cells with the columns lined up, two spaces apart; the first row is the heading. Cells
// that look like numbers stand to the right.
std::string FormatTable(const std::vector<std::vector<std::string>>& rows);

}  // namespace relume::client
