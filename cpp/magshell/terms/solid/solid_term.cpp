#include "magshell/terms/solid/solid_term.h"

#include "magshell/core/errors.h"
#include "magshell/terms/solid/solid_materials.h"

namespace magshell {

std::unique_ptr<SolidTerm> make_solid_term(const SolidResponse& response, const Solid& solid, Index body,
                                           const ColoredLoop& element_blocks, const SystemMatrix& matrix,
                                           const Nodes& nodes, Registry& registry) {
    if (response.mean_volume && !solid.quadratic())
        throw InvalidInput(
            "the mean volume of an element is for quadratic tetrahedra: linear ones have one point");
    for (MakeSolidTerm* make :
         {make_neo_hookean_term, make_isochoric_term, make_stable_neo_hookean_term,
          make_strain_quadratic_term, make_corotated_term, make_guccione_term, make_projective_term})
        if (std::unique_ptr<SolidTerm> term =
                make(response, solid, body, element_blocks, matrix, nodes, registry))
            return term;
    throw InvalidInput("no solid material is called " + response.material);
}

}  // namespace magshell
