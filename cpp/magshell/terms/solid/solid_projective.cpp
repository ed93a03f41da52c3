#include "magshell/core/errors.h"
#include "magshell/energy/projective.h"
#include "magshell/terms/solid/tetrahedra_term.h"

namespace magshell {
namespace {

std::unique_ptr<SolidTerm> make_projective_term(const SolidTermInput& input) {
    if (input.response.mean_volume)
        throw InvalidInput("the Projective energy has no part that acts on the mean volume of an element");
    return make_tetrahedra_term<Projective, LameModuli>(input);
}

}  // namespace

SolidMaterials projective_materials() {
    return {{"Projective", &make_projective_term}};
}

}  // namespace magshell
