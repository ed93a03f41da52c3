// RestGradient: the gradient of a loss by rest positions, as far as the core computes it: through the shape of bodies at rest, and through
// what supports prescribe. The caller adds what follows from the other gradients.
#pragma once

#include "magshell/scene/rest_gradient.h"

namespace magshell {

struct RestGradient {
    bool asked = false;
    VectorXd by_nodes;  // three numbers per node

    void clear(const Model& model) { by_nodes = VectorXd::Zero(3 * model.nodes().n_nodes()); }
    /// Adds lambda . dg/dX at the last evaluated state q; ModelParameters::vjp() had the same arguments.
    void add(Model& model, const VectorXd& q, const LoadParameters& load_parameters, const VectorXd& lambda) {
        if (asked) add_rest_vjp(model, q, load_parameters, lambda, by_nodes);
    }
    /// Adds - lambda . df/dX of forces without an energy at the last evaluated state.
    void add_forces(Model& model, const VectorXd& lambda) {
        if (asked) add_rest_forces_vjp(model, lambda, by_nodes);
    }
    /// Adds lambda . dg/dX of the contact forces, with friction, alone.
    void add_contacts(Model& model, const VectorXd& q, const LoadParameters& load_parameters,
                      const VectorXd& lambda) {
        if (asked) model.contacts().add_rest_vjp(q, load_parameters, lambda, by_nodes);
    }
    /// Adds that of the strains times stresses at the last evaluated state.
    void add_strains(const ViscousTerms& terms, const StrainSet& stresses) {
        if (asked && !stresses.empty()) add_rest_strains_vjp(terms, stresses, by_nodes);
    }
    /// Adds that of the directions at the start of a motion, which are those at rest. by_q: of all dofs.
    void add_directions_at_start(const Model& model, const VectorXd& by_q) {
        const Index first = model.nodes().n_coordinates(), count = by_nodes.size() - first;
        by_nodes.tail(count) += by_q.segment(first, count);
    }
    /// Adds the part of a gradient with respect to all dofs that is by those that supports prescribe, and by those that ties and rigid
    /// bodies move. Arguments as in DofMap::vjp.
    void add_constrained(const DofMap& dof_map, const VectorXd& by_q, const VectorXd& lambda,
                         const VectorXd& gradient, const LoadParameters& load_parameters,
                         const VectorXd& by_motor_forces = {}) {
        if (!asked) return;
        dof_map.held_rest_vjp(by_q, load_parameters, by_nodes);
        dof_map.rest_vjp(by_q, lambda, gradient, by_motor_forces, by_nodes);
    }
};

}  // namespace magshell
