// The energies of single elements of the bodies of a scene.
#pragma once

#include <algorithm>
#include <string_view>
#include <vector>

#include "magshell/scene/model.h"
#include "magshell/terms/element_energies.h"
#include "magshell/terms/shell/elastic_term.h"

namespace magshell {

/// The energies [J] of the faces of a shell or of the elements of a solid, in the numbering of the caller, by one term.
struct EnergiesOfElements {
    std::string_view name;
    bool of_solid;
    Index number;  // of Bodies::solids(), or of Bodies::shells() and after them of Bodies::six_node_shells()
    std::vector<double> of_elements;
};

/// Returns the energies of the elements at q by all terms whose energy is a sum over those of a shell or a solid, in the order of
/// Model::energies(). The model must have the turns of angles at q.
inline std::vector<EnergiesOfElements> element_energies(Model& model, const VectorXd& q,
                                                        const LoadParameters& load_parameters) {
    const Bodies& bodies = model.bodies();
    const Index shells = static_cast<Index>(bodies.shells().size()),
                solids = static_cast<Index>(bodies.solids().size());
    std::vector<EnergiesOfElements> all;
    for (const std::unique_ptr<Term>& term : model.terms().energies) {
        Index number = term->body();
        const bool of_solid = number >= shells && number < shells + solids;
        const std::vector<Index>* user = nullptr;
        if (number < 0) continue;
        if (of_solid) {
            number -= shells;
            user = &bodies.solids()[number]->elements.user;
        } else if (number < shells) {
            user = &bodies.shells()[number]->faces.user;
        } else {
            const std::vector<Index>& six = bodies.six_node_bodies();
            const auto at = std::find(six.begin(), six.end(), number);
            if (at == six.end()) continue;
            const Index k = static_cast<Index>(at - six.begin());
            number = shells + k;
            user = &bodies.six_node_shells()[k]->faces.user;
        }
        if (const auto* summed = dynamic_cast<const ElementEnergies*>(term.get())) {
            all.push_back(
                {term->name(), of_solid, number, summed->element_energies(q.data(), load_parameters)});
        } else if (auto* elastic = dynamic_cast<ElasticTerm*>(term.get()); elastic && !of_solid) {
            const Strains strains = elastic->strains(q.data()), stresses = elastic->stresses(strains);
            std::vector<double> energies(user->size(), 0.0);
            for (Index element = 0; element < strains.elements; ++element)
                for (int i = 0; i < strains.width; ++i)
                    energies[(*user)[element]] +=
                        0.5 * strains.number(element, i) * stresses.number(element, i);
            all.push_back({term->name(), of_solid, number, std::move(energies)});
        }
    }
    return all;
}

}  // namespace magshell
