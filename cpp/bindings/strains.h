// Converts the largest strains of a state to Python.
#pragma once

#include "bindings/bindings.h"
#include "magshell/scene/principal_strains.h"

namespace magshell::bindings {

/// Returns (membrane strain, its face, bending strain, its face).
inline py::tuple to_tuple(const LargestStrains& largest) {
    return py::make_tuple(largest.membrane, largest.membrane_face, largest.bending, largest.bending_face);
}

}  // namespace magshell::bindings
