#pragma once

#include <cstdint>
#include <string_view>

namespace relume {

// XXH64 of bytes: finds what a wire or a memory has changed by chance, at about 10 GB/s; no defence
// against somebody who wants to deceive. Digests of parts are chained: one is the next one's seed.
// By libxxhash. Specification: Collet, xxHash fast digest algorithm, 0.1.1.
std::uint64_t Xxh64(std::string_view bytes, std::uint64_t seed = 0);

}  // namespace relume
