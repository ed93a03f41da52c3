// The triangles of magnetized solids, on which the charges of their own field lie (energy/own_field.h).
#pragma once

#include <vector>

#include "magshell/body/solid.h"
#include "magshell/energy/own_field.h"

namespace magshell {

/// Returns the faces of all tetrahedra, each once, with the tetrahedra numbered solid by solid. A face of a ten-node tetrahedron is four
/// flat triangles between its six nodes.
OwnField::Triangles triangles_of(const std::vector<const Solid*>& solids);

}  // namespace magshell
