#pragma once

#include <cstdint>

namespace relume {

// Bytes of memory that this process can hope for: the machine's, or fewer if its control group
// (version 2, as containers have) may take fewer.
std::uint64_t MachineMemory();

}  // namespace relume
