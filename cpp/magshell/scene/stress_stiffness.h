// The stiffness of the rates of stresses, for linear buckling, and its derivatives. terms/stress_rate_term.h has the formulas.
#pragma once

#include <string_view>
#include <vector>

#include "magshell/scene/model.h"

namespace magshell {

/// Holds the stresses of all terms at their rates as q moves at the rates p of all dofs, or at zero if p is nullptr, until release_stresses().
void freeze_stress_rates(Model& model, const VectorXd& q, const LoadParameters& load_parameters,
                         const VectorXd* p);
void release_stresses(Model& model);

/// Returns the strain rates J p at q of each term.
std::vector<VectorXd> strain_rates(Model& model, const VectorXd& q, const LoadParameters& load_parameters,
                                   const VectorXd& p);
/// Adds the derivatives of W = s . c at q, with the stresses s and the strain curvatures c of each term as strain_rates() has them: by q, by
/// parameters, and by the rest shape (three numbers per node) if by_rest is not nullptr. Throws InvalidInput if c has another size.
void add_stress_work_vjp(Model& model, const VectorXd& q, const LoadParameters& load_parameters,
                         const std::vector<VectorXd>& curvatures, VectorXd& by_q, Gradient& out,
                         VectorXd* by_rest);
/// Returns the names of the terms whose stress rates have no such derivatives.
std::vector<std::string_view> without_stress_work_vjp(const Model& model);

}  // namespace magshell
