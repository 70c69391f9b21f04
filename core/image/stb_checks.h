#pragma once

#include <string>
#include <string_view>

namespace relume {

// What stb_image 2.27 does not look at itself before it decodes, so that damaged bytes would be
// shown as pixels or write beyond a table. Each throws Error naming `name`.

// A PNG of more than kMaxReadPixels (kResourceExhausted); stb has no message of its own for it.
void CheckPngForStb(std::string_view bytes, const std::string& name);
// A Huffman table of more than 256 codes (kDataLoss).
void CheckJpegForStb(std::string_view bytes, const std::string& name);
// A flat TGA with fewer bytes than its pixels take (kDataLoss).
void CheckTgaForStb(std::string_view bytes, const std::string& name);

}  // namespace relume
