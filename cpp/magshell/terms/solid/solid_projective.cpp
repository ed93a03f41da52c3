#include "magshell/core/errors.h"
#include "magshell/energy/projective.h"
#include "magshell/terms/solid/solid_materials.h"
#include "magshell/terms/solid/tetrahedra_term.h"

namespace magshell {

std::unique_ptr<SolidTerm> make_projective_term(const SolidResponse& response, const Solid& solid, Index body,
                                                const ColoredLoop& element_blocks, const SystemMatrix& matrix,
                                                const Nodes& nodes, Registry& registry) {
    if (response.material != "Projective") return nullptr;
    if (response.mean_volume)
        throw InvalidInput("the Projective energy has no part that acts on the mean volume of an element");
    if (solid.quadratic())
        return std::make_unique<TetrahedraTerm<QuadraticTetrahedron, Projective, LameModuli, false>>(
            solid, solid.quadratic_nodes, body, element_blocks, matrix, nodes, registry);
    return std::make_unique<TetrahedraTerm<LinearTetrahedron, Projective, LameModuli, false>>(
        solid, solid.linear_nodes, body, element_blocks, matrix, nodes, registry);
}

}  // namespace magshell
