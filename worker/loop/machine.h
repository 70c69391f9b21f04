#pragma once

#include <string>

namespace relume::worker {

// The same in all processes and containers of one machine until that starts again, and different on
// each machine.
std::string MachineId();

}  // namespace relume::worker
