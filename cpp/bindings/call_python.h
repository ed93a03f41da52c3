// Calls the caller's Python functions from inside a solve.
#pragma once

#include <utility>

#include "bindings/bindings.h"
#include "magshell/core/errors.h"

namespace magshell::bindings {

/// Calls a function with the GIL. Ctrl-C while it runs ends the solve; its other exceptions are passed on.
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
