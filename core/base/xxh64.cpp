#include "core/base/xxh64.h"

#define XXH_INLINE_ALL
#include <xxhash.h>

namespace relume {

std::uint64_t Xxh64(std::string_view bytes, std::uint64_t seed) {
    return XXH64(bytes.data(), bytes.size(), seed);
}

}  // namespace relume
