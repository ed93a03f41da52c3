#include "magshell/terms/solid/solid_term.h"

#include "magshell/core/errors.h"
#include "magshell/terms/solid/material_files.h"  // written by CMake: MAGSHELL_SOLID_MATERIALS(each)
#include "magshell/terms/solid/solid_materials.h"

namespace magshell {

#define DECLARE(file) SolidMaterials file##_materials();
MAGSHELL_SOLID_MATERIALS(DECLARE)
#undef DECLARE

std::unique_ptr<SolidTerm> make_solid_term(const SolidResponse& response, const Solid& solid, Index body,
                                           const ColoredLoop& element_blocks, const SystemMatrix& matrix,
                                           const Nodes& nodes, Registry& registry) {
    if (response.mean_volume && !solid.quadratic())
        throw InvalidInput(
            "the mean volume of an element is for quadratic tetrahedra: linear ones have one point");
#define LIST(file) &file##_materials,
    for (SolidMaterials (*const materials)() : {MAGSHELL_SOLID_MATERIALS(LIST)})
        for (const auto& [name, make] : materials())
            if (name == response.material)
                return make({response, solid, body, element_blocks, matrix, nodes, registry});
#undef LIST
    throw InvalidInput("no solid material is called " + response.material);
}

}  // namespace magshell
