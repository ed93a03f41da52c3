#include "magshell/solve/unsymmetric.h"

#include <string>

#include "magshell/core/errors.h"

namespace magshell {

GmresReport solve_unsymmetric(const Model& model, const Factor& factor, bool transposed,
                              const GmresOptions& options, VectorXd& reduced) {
    const Reduction& reduction = model.reduction();
    // What is preconditioned comes back from the symmetric part as it went in, to round-off of the factorization: only
    // where that counts the product is made.
    constexpr double coarse = 1e-10;
    const bool known = options.tolerance > coarse;
    VectorXd before;
    const auto assembled = [&](const VectorXd& x) {
        VectorXd rest = VectorXd::Zero(model.size());
        model.remainder().add_product(reduction.expand(x), transposed, rest);
        return VectorXd((known ? before : factor.image(x)) + reduction.vector(rest));
    };
    const auto precondition = [&](VectorXd& x) {
        if (known) before = x;
        factor.solve(x);
    };
    return gmres(assembled, precondition, reduced, options);
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
