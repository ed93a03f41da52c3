// Calls of the caller's own functions from inside a solve.
#pragma once

#include <utility>

#include "bindings/bindings.h"
#include "magshell/core/errors.h"

namespace magshell::bindings {

/// With the GIL. Ctrl-C while the function runs ends the solve as it does anywhere else; what else it raises passes.
template <class... Arguments>
py::object call_python(const py::object& function, Arguments&&... arguments) {
    try {
        return function(std::forward<Arguments>(arguments)...);
    } catch (const py::error_already_set& error) {
        if (!error.matches(PyExc_KeyboardInterrupt)) throw;
        throw Interrupted();
    }
}

}  // namespace magshell::bindings
