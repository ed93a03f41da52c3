// Exceptions of the core, by what the caller should do. The bindings translate each into one Python exception.
#pragma once

#include <stdexcept>
#include <string>

namespace magshell {

/// The input is invalid; thrown before any work starts, except where only the work reveals it. ValueError in Python.
struct InvalidInput : std::invalid_argument {
    using std::invalid_argument::invalid_argument;
};

/// The user pressed Ctrl-C during a solve. KeyboardInterrupt in Python.
struct Interrupted : std::runtime_error {
    Interrupted() : std::runtime_error("interrupted") {}
};

}  // namespace magshell
