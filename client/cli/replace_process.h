#pragma once

#include <string>
#include <vector>

namespace relume::client {

// Becomes the program `name` that lies beside this one: its output, exit code and signals are
// this process's own from then on. Throws kNotFound if it can't be started.
[[noreturn]] void ReplaceProcess(const std::string& name,
                                 const std::vector<std::string>& arguments);

}  // namespace relume::client
