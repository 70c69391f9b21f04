#pragma once

#include <cstdint>
#include <string>

#include "core/film/tile.h"

namespace relume::server {

// Proof that the holder of `secret` has once lent these samples: 32 hexadecimal digits, the same
// for the same samples of a job.
std::string MakeTicket(const std::string& secret, const std::string& job, std::uint64_t unit,
                       const TileTask& task);

}  // namespace relume::server
