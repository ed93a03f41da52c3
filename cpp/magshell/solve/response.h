// How an equilibrium answers a change of controls or values, to first order.
#pragma once

#include "magshell/solve/statics.h"

namespace magshell {

/// The change of all unknowns from an equilibrium whose factor was kept to the controls `to` and the values
/// that the model holds now: Newton's first step, with the old Hessian. Throws InvalidInput where no factor
/// was kept.
VectorXd first_order_change(Model& model, const StaticsResult& equilibrium, const Controls& to);

}  // namespace magshell
