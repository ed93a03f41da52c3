// The triangles of magnetized solids, on which the charges of their own field lie (energy/own_field.h).
#pragma once

#include <vector>

#include "magshell/body/solid.h"
#include "magshell/energy/magnetization_law.h"
#include "magshell/energy/own_field.h"

namespace magshell {

struct MagnetizedSolid {
    const Solid* solid;
    MagnetizationLaw law;
};

/// Returns the faces of all tetrahedra, each once, with the tetrahedra numbered solid by solid. A face of a ten-node tetrahedron is four
/// flat triangles between its six nodes.
OwnField::Triangles triangles_of(const std::vector<MagnetizedSolid>& solids);

}  // namespace magshell
