#include "magshell/energy/guccione.h"
#include "magshell/terms/solid/tetrahedra_term.h"

namespace magshell {

SolidMaterials guccione_materials() {
    return {{"Guccione", &make_tetrahedra_term<Guccione, NamedModuli<Guccione>>}};
}

}  // namespace magshell
