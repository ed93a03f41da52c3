// What can go wrong, by what the caller should do about it. The bindings turn each into one Python exception.
#pragma once

#include <stdexcept>
#include <string>

namespace magshell {

/// The caller's input is wrong; raised before any work starts. ValueError in Python.
struct InvalidInput : std::invalid_argument {
    using std::invalid_argument::invalid_argument;
};

/// Ctrl-C arrived while a solve was running. KeyboardInterrupt in Python.
struct Interrupted : std::runtime_error {
    Interrupted() : std::runtime_error("interrupted") {}
};

}  // namespace magshell
