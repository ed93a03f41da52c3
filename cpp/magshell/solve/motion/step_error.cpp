#include "magshell/solve/motion/step_error.h"

#include <cmath>

namespace magshell {

ErrorWeights error_weights(const Tableau& tableau) {
    // Rows at most, for memory on the stack; see test_estimate_agrees_with_the_error_of_one_step.
    constexpr int most = Tableau::max_stages + 1;
    using Square = Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, 0, most, most>;
    const int n = tableau.stages + 1, shift = tableau.begins_explicitly ? 0 : 1;
    Square a = Square::Zero(n, n);
    for (int i = 0; i < tableau.stages; ++i)
        for (int j = 0; j + shift <= i + 1; ++j) a(i + 1, j + shift) = tableau.a[i][j];
    Square moments(n, n);
    ErrorWeights column = ErrorWeights::Ones(n), wanted(n);
    double factorial = 1.0;
    for (int k = 0; k < n; ++k) {
        moments.row(k) = column.transpose();
        wanted(k) = 1.0 / (factorial *= k + 1);
        column = (a * column).eval();
    }
    return a.row(n - 1).transpose() - moments.partialPivLu().solve(wanted);
}

double step_error(const Model& model, const StepAlgebra& step, const FreeFlight& flight,
                  const VectorXd& begin, std::span<const StageRates> rates) {
    const ErrorWeights weights = error_weights(step.tableau());
    const std::size_t stages = step.tableau().stages, first = rates.size() - stages;
    VectorXd error = weights(0) * begin;
    for (std::size_t i = 0; i < stages; ++i) error += weights(i + 1) * rates[first + i].v;
    flight.subtract_velocities({weights.data(), stages + 1}, error);
    const DofMap& dof_map = model.dof_map();
    if (dof_map.has_supports() || dof_map.has_motors()) error = dof_map.project(error);
    const Rows3 of_points = model.bodies().points(error);
    return step.dt() * std::sqrt(of_points.squaredNorm() / static_cast<double>(of_points.rows()));
}

}  // namespace magshell
