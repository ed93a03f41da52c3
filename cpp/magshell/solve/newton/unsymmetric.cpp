#include "magshell/solve/newton/unsymmetric.h"

#include "magshell/solve/step_rules.h"

namespace magshell {

GmresReport solve_unsymmetric(const Model& model, const Factor& factor, bool transposed,
                              const GmresOptions& options, VectorXd& reduced) {
    const DofMap& dof_map = model.dof_map();
    // Multiplying a preconditioned vector by the symmetric part returns it up to the round-off of the factorization. The product is
    // therefore computed only for tight tolerances; see test_methods_of_second_order_stick.
    const bool known = options.tolerance > small_part * negligible_length;
    VectorXd before;
    const auto assembled = [&](const VectorXd& x) {
        VectorXd rest = VectorXd::Zero(model.size());
        model.nonsymmetric_tangent().add_product(dof_map.expand(x), transposed, rest);
        return VectorXd((known ? before : factor.image(x)) + dof_map.vector(rest));
    };
    const auto precondition = [&](VectorXd& x) {
        if (known) before = x;
        factor.solve(x);
    };
    return gmres(assembled, precondition, reduced, options);
}

}  // namespace magshell
