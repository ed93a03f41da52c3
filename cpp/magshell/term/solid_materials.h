// The terms of each family of materials, instantiated in a file of their own; nullptr where a name is not theirs.
#pragma once

#include "magshell/term/solid_term.h"

namespace magshell {

using MakeSolidTerm = std::unique_ptr<SolidTerm>(const SolidResponse&, const Solid&, Index body,
                                                 const ChunkLoop&, const SystemMatrix&, const Nodes&,
                                                 Registry&);

MakeSolidTerm make_neo_hookean_term, make_isochoric_term, make_stable_neo_hookean_term,
    make_strain_quadratic_term, make_corotated_term, make_guccione_term, make_projective_term;

}  // namespace magshell
