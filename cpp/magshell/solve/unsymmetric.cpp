#include "magshell/solve/unsymmetric.h"

#include <string>

#include "magshell/core/errors.h"

namespace magshell {

GmresReport solve_unsymmetric(const Model& model, const Factor& factor, bool transposed,
                              const GmresOptions& options, VectorXd& reduced) {
    const Reduction& reduction = model.reduction();
    const auto assembled = [&](const VectorXd& x) {
        VectorXd rest = VectorXd::Zero(model.size());
        model.remainder().add_product(reduction.expand(x), transposed, rest);
        return VectorXd(factor.image(x) + reduction.vector(rest));
    };
    return gmres(assembled, [&](VectorXd& x) { factor.solve(x); }, reduced, options);
}

void solve_at_equilibrium(const Model& model, const Factor& factor, bool transposed, VectorXd& reduced) {
    if (!model.unsymmetric()) {
        factor.solve(reduced);
        return;
    }
    const GmresReport report = solve_unsymmetric(model, factor, transposed, to_round_off, reduced);
    if (!report.converged)
        throw InvalidInput("a linear solve with a pressure that has no potential stopped at a residual of " +
                           std::to_string(report.residual));
}

}  // namespace magshell
