// Edge rotations in equilibrium at fixed vertices. They have no inertia, and the energy is quadratic in them.
#pragma once

#include <memory>

#include "magshell/scene/model.h"

namespace magshell {

class EdgeRotationEquilibrium {
  public:
    /// Evaluates and assembles at q, and factorizes the stiffness of the rotations.
    EdgeRotationEquilibrium(Model& model, const VectorXd& q, const LoadParameters& load_parameters);
    ~EdgeRotationEquilibrium();

    /// Returns the increment of the edge rotations of q to equilibrium; zero for all other dofs.
    VectorXd correction() const;
    /// Returns - H^-1 by_state on the rotations and zero elsewhere: the adjoint of the equilibrium.
    VectorXd adjoint(const VectorXd& by_state) const;

  private:
    Model& model_;
    Index first_;  // index of the first edge rotation among the dofs
    struct Factorization;
    std::unique_ptr<Factorization> factor_;
};

}  // namespace magshell
