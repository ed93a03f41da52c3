#include "magshell/energy/st_venant_kirchhoff.h"
#include "magshell/terms/solid/tetrahedra_term.h"

namespace magshell {

SolidMaterials st_venant_kirchhoff_materials() {
    return {{"StVenantKirchhoff", &make_tetrahedra_term<StVenantKirchhoff, LameModuli>}};
}

}  // namespace magshell
