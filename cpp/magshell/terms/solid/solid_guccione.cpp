#include "magshell/energy/guccione.h"
#include "magshell/terms/solid/solid_materials.h"
#include "magshell/terms/solid/tetrahedra_term.h"

namespace magshell {

std::unique_ptr<SolidTerm> make_guccione_term(const SolidResponse& response, const Solid& solid, Index body,
                                              const ColoredLoop& element_blocks, const SystemMatrix& matrix,
                                              const Nodes& nodes, Registry& registry) {
    if (response.material == "Guccione")
        return make_tetrahedra_term<Guccione, GuccioneModuli>(response.mean_volume, solid, body,
                                                              element_blocks, matrix, nodes, registry);
    return nullptr;
}

}  // namespace magshell
