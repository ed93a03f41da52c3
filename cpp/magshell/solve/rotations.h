// Edge rotations at rest under held vertices: they have no inertia, and the energy is quadratic in them.
#pragma once

#include <Eigen/SparseCholesky>

#include "magshell/scene/model.h"

namespace magshell {

class RotationsAtRest {
  public:
    /// Evaluates and assembles at q.
    RotationsAtRest(Model& model, const VectorXd& q, const Controls& controls);

    /// What to add to the rotations of q for them to be at rest; zero for all other unknowns.
    VectorXd correction() const;
    /// - H^-1 by_state on the rotations, zero elsewhere: the adjoint of their being at rest.
    VectorXd adjoint(const VectorXd& by_state) const;

  private:
    Model& model_;
    Index first_;  // unknown that is a rotation
    Eigen::SimplicialLDLT<Eigen::SparseMatrix<double>> factor_;
};

}  // namespace magshell
