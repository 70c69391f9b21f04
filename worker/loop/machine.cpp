#include "worker/loop/machine.h"

#include <unistd.h>

#include <fstream>

namespace relume::worker {

std::string MachineId() {
    std::string id;
    if (std::ifstream file("/proc/sys/kernel/random/boot_id"); file >> id) {
        return id;
    }
    char host[256] = "";
    gethostname(host, sizeof host - 1);
    return host;
}

}  // namespace relume::worker
