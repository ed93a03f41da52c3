// Predicts the penetration depth of vertices that a time step or a Newton step has put deep into an obstacle.
//
// Why: the penalty force at such a depth can be many times the force that stops the vertex, and Newton's method then only halves the
// depth per iteration (see test_an_impact_takes_few_factorizations). For one vertex alone the depth at which
// inertia and contact balance has a closed form:
//
//   w (depth0 - depth) + N0 = N(depth)        w: inertia of the vertex over the stage [N/m], N0: force predicted without it [N],
//                                             N: penalty law (energy/contact.h)
#pragma once

#include "magshell/scene/model.h"

namespace magshell {

/// Returns the displacement that moves overshooting vertices to their balanced depth, projected onto the free dofs; empty if there
/// is none. A vertex overshoots if its penalty force at q exceeds twice its balanced force.
/// weights: those of the proximal term [N/m], per dof. expected: contacts with their predicted forces [N].
VectorXd predict_contact(const Model& model, const VectorXd& q, const LoadParameters& load_parameters,
                         const VectorXd& weights, const std::vector<Contacts::ObstaclePoint>& expected);

}  // namespace magshell
