// The forces of those energies of a scene that may change with some of its parameters, at a fixed state.
#pragma once

#include <vector>

#include "magshell/scene/model.h"

namespace magshell {

class ChangingForces {
  public:
    /// The parameters may change from `here`, which the model has now, towards `there`, both in the order of the caller; load parameters may
    /// change too. The model must outlive this object.
    ChangingForces(Model& model, const VectorXd& here, const VectorXd& there);

    /// Returns the sum of their gradients at q.
    VectorXd at(const VectorXd& q, const LoadParameters& load_parameters) const;

  private:
    std::vector<Term*> terms_;
};

}  // namespace magshell
