// Compiler and libraries of this build, for show_config().
#pragma once

#include <string>
#include <utility>
#include <vector>

namespace magshell {

/// Returns names and values, in the order in which they should be read.
std::vector<std::pair<std::string, std::string>> linalg_build_info();

}  // namespace magshell
