// Creates the solid terms of each family of materials. Each function is in a file of its own, so that its
// templates compile in parallel; it returns nullptr if the material's name is not one of its family.
#pragma once

#include "magshell/terms/solid/solid_term.h"

namespace magshell {

using MakeSolidTerm = std::unique_ptr<SolidTerm>(const SolidResponse&, const Solid&, Index body,
                                                 const ColoredLoop&, const SystemMatrix&, const Nodes&,
                                                 Registry&);

MakeSolidTerm make_neo_hookean_term, make_isochoric_term, make_stable_neo_hookean_term,
    make_strain_quadratic_term, make_corotated_term, make_guccione_term, make_projective_term;

}  // namespace magshell
