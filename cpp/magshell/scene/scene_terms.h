// SceneTerms holds the terms of a scene: those of the energy, the forces without an energy, and the loops over elements that they share. It is
// made once from the description of the scene.
#pragma once

#include <memory>
#include <string_view>
#include <vector>

#include "magshell/assembly/contact_layer.h"
#include "magshell/assembly/element_loop.h"
#include "magshell/body/membrane_faces.h"
#include "magshell/scene/bodies.h"
#include "magshell/terms/contact/contacts.h"
#include "magshell/terms/force_term.h"
#include "magshell/terms/magnetic/field_sources.h"
#include "magshell/terms/shell/viscous_terms.h"

namespace magshell {

class DampedTerm;
class LowRankTerm;
class MuscleTerm;
class OperatorTerm;
class OwnFieldTerm;
class SolidTerm;

struct SceneTerms {
    /// Registers the parameters of all terms. The references must outlive the terms.
    SceneTerms(const SceneInput& input, const Bodies& bodies, const SystemMatrix& matrix, Registry& registry);
    SceneTerms(const SceneTerms&) = delete;
    SceneTerms& operator=(const SceneTerms&) = delete;
    ~SceneTerms();

    ElementColoring coloring;
    FieldSources field_sources;
    std::vector<std::unique_ptr<FaceLoop>> loops;  // of each of Bodies::faces(); nullptr if it has no blocks
    std::vector<std::unique_ptr<MembraneFaces>> membrane_faces;  // of each shell
    std::vector<std::unique_ptr<FaceLoop>>
        membrane_loops;                           // nullptr if the membrane uses the shell's own faces
    std::unique_ptr<ContactLayer> contact_layer;  // nullptr without contact between bodies

    std::vector<std::unique_ptr<Term>> energies;  // their order is that of summation
    std::vector<std::unique_ptr<ForceTerm>> forces;

    // The same terms, sorted by the questions that Model asks them.
    std::vector<std::vector<const Term*>> of_body;  // those that are assembled by the blocks of each body
    std::vector<const Term*> restricting;           // those that have no energy in some states
    std::vector<LowRankTerm*> low_rank;
    std::vector<const OperatorTerm*> operators;
    const OwnFieldTerm* own_field = nullptr;
    ViscousTerms elastic, dampers;          // those to which viscosity applies; there may be no dampers
    std::vector<const DampedTerm*> damped;  // the dampers
    std::vector<const SolidTerm*> solids;
    std::vector<const MuscleTerm*> muscles;
    Contacts contacts;
    Capabilities capabilities;  // union of those of all terms

    /// Returns a term of a shell, "membrane" or "bending".
    const ElasticTerm& elastic_term(Index shell, std::string_view name) const;
    std::size_t bytes() const;
};

}  // namespace magshell
