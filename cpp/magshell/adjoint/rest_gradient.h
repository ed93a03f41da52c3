// RestGradient: the gradient of a loss by rest positions, as far as the core computes it: through the elastic energies of three-node shells, and
// through what supports prescribe. The caller adds what follows from the other gradients.
#pragma once

#include "magshell/scene/shells_rest_gradient.h"

namespace magshell {

struct RestGradient {
    std::vector<VectorXd> curvature_scales;  // as in scene/shells_rest_gradient.h; empty: not asked for
    VectorXd by_nodes;                       // three numbers per node
    VectorXd by_prescribed;                  // of all dofs: by the prescribed positions

    bool asked() const { return !curvature_scales.empty(); }

    void clear(const Model& model) {
        by_nodes = VectorXd::Zero(3 * model.nodes().n_nodes());
        by_prescribed = VectorXd::Zero(model.size());
    }
    /// Adds lambda . dg/dX at the last evaluated state q.
    void add(Model& model, const VectorXd& q, const VectorXd& lambda) {
        by_nodes += shells_rest_vjp(model, q, lambda, curvature_scales);
    }
    /// Adds the part of a gradient by all dofs that is by prescribed ones.
    void add_prescribed(const DofMap& dof_map, const VectorXd& by_q) {
        by_prescribed += by_q - dof_map.expand(dof_map.vector(by_q));
    }
};

}  // namespace magshell
