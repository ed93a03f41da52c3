#include "magshell/energy/st_venant_kirchhoff.h"
#include "magshell/terms/solid/solid_materials.h"
#include "magshell/terms/solid/tetrahedra_term.h"

namespace magshell {

std::unique_ptr<SolidTerm> make_strain_quadratic_term(const SolidResponse& response, const Solid& solid,
                                                      Index body, const ColoredLoop& element_blocks,
                                                      const SystemMatrix& matrix, const Nodes& nodes,
                                                      Registry& registry) {
    if (response.material == "StVenantKirchhoff")
        return make_tetrahedra_term<StVenantKirchhoff, LameModuli>(response.mean_volume, solid, body,
                                                                   element_blocks, matrix, nodes, registry);
    return nullptr;
}

}  // namespace magshell
