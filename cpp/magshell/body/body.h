// The interface of a body for assembly: the dofs that its elements couple, and the dihedral angles that belong to them.
#pragma once

#include <span>

#include "magshell/core/types.h"

namespace magshell {

class Body {
  public:
    virtual ~Body() = default;

    virtual Index n_elements() const = 0;
    /// Returns the nodes that an element couples; negative entries are absent.
    virtual std::span<const Index> nodes_of(Index element) const = 0;
    /// Returns the scalar dofs that an element couples; negative entries are absent.
    virtual std::span<const Index> scalars_of(Index /*element*/) const { return {}; }

    virtual Index n_dihedrals() const { return 0; }
    /// Returns the first element that a dihedral angle belongs to; ascending with the angle.
    virtual Index element_of_dihedral(Index /*dihedral*/) const { return 0; }
};

}  // namespace magshell
