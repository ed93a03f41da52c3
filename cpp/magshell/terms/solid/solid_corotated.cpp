#include "magshell/energy/corotated.h"
#include "magshell/terms/solid/tetrahedra_term.h"

namespace magshell {

SolidMaterials corotated_materials() {
    return {{"Corotated", &make_tetrahedra_term<Corotated, LameModuli>}};
}

}  // namespace magshell
