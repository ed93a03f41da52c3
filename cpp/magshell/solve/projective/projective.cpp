#include "magshell/solve/projective/projective.h"

#include <cmath>
#include <string>
#include <utility>

#include "magshell/solve/globalization/lbfgs_history.h"
#include "magshell/solve/projective/anderson.h"

namespace magshell {
namespace {

// [-] Shortest admissible step length; see test_rounds_without_a_tolerance_do_not_run_away.
constexpr double min_projective_step = 1e-9;
// [-] Largest violation of Coulomb's law at convergence, over the extent; see test_block_sticks_below_the_angle_of_friction.
constexpr double law_tolerance = 1e-10;
// Iterations between two checks whether contacts have opened or closed, which changes the matrix; see test_free_bodies_and_obstacles_by_penalty.
constexpr int iterations_between_checks = 5;
// [-] Change of a diagonal entry, over its size, that is left to L-BFGS; see test_free_bodies_and_obstacles_by_penalty.
constexpr double max_diagonal_change = 0.5;

// Returns what contact pairs add to the diagonal of each node, summed over its three dofs [N/m].
VectorXd diagonal_of(const std::vector<PairStiffness>& pairs, Index nodes) {
    VectorXd of_nodes = VectorXd::Zero(nodes);
    for (const PairStiffness& pair : pairs)
        for (int i = 0; i < pair.count; ++i)
            of_nodes[pair.nodes[i]] += pair.weights[i] * pair.weights[i] * pair.stiffness.trace();
    return of_nodes;
}

}  // namespace

ProjectiveSolver::ProjectiveSolver(Newton& newton, const ProjectiveOptions& options)
    : newton_(newton),
      model_(newton.model()),
      options_(options),
      matrix_(newton.model()),
      touching_(newton.model(), matrix_) {
    if (options.coulomb) aside_.emplace(model_);
}

VectorXd ProjectiveSolver::reduced_gradient(const VectorXd& q, const ProximalTerm& proximal) const {
    return model_.dof_map().vector(newton_.gradient(q, proximal));
}

bool ProjectiveSolver::contact_stiffness_changed(const ProximalTerm& proximal, VectorXd& before) const {
    if (!model_.capabilities().has_stiffness_jumps) return false;
    VectorXd now = model_.contact_stiffness_diagonal();
    bool changed = false;
    for (Index node = 0; node < now.size() && !changed; ++node)
        changed =
            std::abs(now[node] - before[node]) >
            max_diagonal_change * ((*proximal.weights)[3 * node] + matrix_.stiffness(node) + before[node]);
    if (changed) before = std::move(now);
    return changed;
}

void ProjectiveSolver::prepare(const VectorXd& q, const ProximalTerm& proximal, double scale) {
    const int factorized = matrix_.factorizations();
    matrix_.set(scale, *proximal.weights, model_.contact_stiffness_diagonal());
    newton_.count_factorizations(matrix_.factorizations() - factorized);
    matrix_.linearize(q);
}

NewtonReport ProjectiveSolver::solve(VectorXd& q, const LoadParameters& load_parameters,
                                     const ProximalTerm& proximal, double scale) {
    const Capabilities& has = model_.capabilities();
    const bool touches = options_.coulomb && (has.has_stiffness_jumps || has.has_barrier);
    return touches ? solve_with_coulomb(q, load_parameters, proximal, scale)
                   : solve_smooth(q, load_parameters, proximal, scale);
}

NewtonReport ProjectiveSolver::solve_smooth(VectorXd& q, const LoadParameters& load_parameters,
                                            const ProximalTerm& proximal, double scale) {
    NewtonReport report;
    const auto fail = [&](std::string reason) {
        report.reason = std::move(reason);
        return report;
    };
    if (std::string reason = model_.capabilities().invalid_state_reason(q); !reason.empty())
        return fail(std::move(reason));
    const DofMap& dof_map = model_.dof_map();
    // The part of the prescribed motion of supports and motors that is still to be made.
    VectorXd move = dof_map.prescribed_increment(q, load_parameters);
    newton_.evaluate(q, load_parameters, proximal);
    prepare(q, proximal, scale);
    LbfgsHistory lbfgs(options_.history);
    // Contact stiffness in the matrix: of obstacles, and of pairs between bodies; the latter is empty until it is set.
    VectorXd touched = model_.contact_stiffness_diagonal(), between;
    // Updates the contact pairs in the matrix if they have changed by much: a dense matrix of many pairs costs more than an iteration.
    const auto take_pairs = [&] {
        if (!model_.capabilities().has_barrier) return;
        const std::vector<PairStiffness> pairs = model_.contact_pair_stiffness();
        VectorXd now = diagonal_of(pairs, model_.nodes().n_nodes());
        bool changed = between.size() == 0;
        for (Index node = 0; node < now.size() && !changed; ++node)
            changed = std::abs(now[node] - between[node]) >
                      max_diagonal_change * (matrix_.diagonal(node) + between[node]);
        if (!changed) return;
        touching_.set(pairs);
        between = std::move(now);
    };
    VectorXd gradient = reduced_gradient(q, proximal);
    for (;; ++report.iterations, newton_.count_iteration()) {
        const bool last = report.iterations == options_.iterations;
        const bool in_place = move.isZero(0.0);
        report.residual = newton_.relative_residual(q, proximal);
        newton_.watch(report.residual);
        if (!std::isfinite(report.residual)) return fail("the iteration diverged");
        if (in_place && options_.tolerance > 0.0 && report.residual <= options_.tolerance &&
            (report.iterations > 0 || newton_.relative_residual(q, proximal, false) <= options_.tolerance))
            report.converged = true;
        if (last && in_place && options_.tolerance == 0.0) report.converged = true;
        if (report.converged) return report;
        if (last)
            return fail("no convergence in " + std::to_string(report.iterations) +
                        " iterations of Projective Dynamics: the residual is " +
                        std::to_string(report.residual));
        if (report.iterations % iterations_between_checks == iterations_between_checks - 1 &&
            contact_stiffness_changed(proximal, touched)) {
            prepare(q, proximal, scale);
            lbfgs.clear();
            between.resize(0);
        }
        take_pairs();
        VectorXd direction = -gradient;
        if (!in_place) direction -= dof_map.vector(matrix_.times(move));
        lbfgs.solve(direction, [&](VectorXd& rhs) { touching_.solve(rhs); });
        double slope = -gradient.dot(direction);
        if (in_place && !(slope > 0.0) && !lbfgs.empty()) {
            lbfgs.clear();
            direction = -gradient;
            touching_.solve(direction);
            slope = -gradient.dot(direction);
        }
        const VectorXd from = q;
        VectorXd step = move + dof_map.expand(direction);
        double alpha = newton_.apply_increment(q, step, min_projective_step, report);
        if (alpha < 0.0) return report;
        move *= 1.0 - alpha;
        newton_.evaluate(q, load_parameters, proximal);
        if (in_place) alpha *= newton_.line_search(q, load_parameters, proximal, from, step, alpha * slope);
        VectorXd now = reduced_gradient(q, proximal);
        if (in_place) lbfgs.add(alpha * direction, now - gradient);
        gradient = std::move(now);
    }
}

// The contact forces are put into the target of the proximal term, so that the residual contains them.
NewtonReport ProjectiveSolver::solve_with_coulomb(VectorXd& q, const LoadParameters& load_parameters,
                                                  const ProximalTerm& proximal, double scale) {
    NewtonReport report;
    const auto fail = [&](std::string reason) {
        report.reason = std::move(reason);
        return report;
    };
    const DofMap& dof_map = model_.dof_map();
    VectorXd first_move = dof_map.prescribed_increment(q, load_parameters);
    if (const double alpha = newton_.apply_increment(q, first_move, min_projective_step, report); alpha < 1.0)
        return fail(alpha < 0.0 ? report.reason
                                : "a prescribed support motion pushes two bodies into each other");
    if (std::string reason = model_.capabilities().invalid_state_reason(q); !reason.empty())
        return fail(std::move(reason));
    newton_.evaluate(q, load_parameters, proximal);
    prepare(q, proximal, scale);
    CoulombContact contact(model_, matrix_, load_parameters, *proximal.motion->x_hat, proximal.motion->time);
    VectorXd target = *proximal.target;
    const ProximalTerm pushed{proximal.weights, &target, proximal.motion};
    Anderson anderson(options_.history);
    const auto last_round = [&](const NewtonReport& now) {
        return now.iterations + 1 == options_.iterations;
    };
    for (;; ++report.iterations, newton_.count_iteration()) {
        report.residual = newton_.relative_residual(q, pushed);
        newton_.watch(report.residual);
        if (!std::isfinite(report.residual)) return fail("the iteration diverged");
        const bool last = report.iterations == options_.iterations;
        const double off = contact.assess(q);
        report.converged = options_.tolerance > 0.0 ? report.residual <= options_.tolerance &&
                                                          off <= law_tolerance * model_.extent()
                                                    : last;
        if (report.converged) return report;
        if (last)
            return fail("no convergence in " + std::to_string(report.iterations) +
                        " iterations of Projective Dynamics with Coulomb's law: the residual is " +
                        std::to_string(report.residual));
        VectorXd direction = -reduced_gradient(q, pushed);
        matrix_.solve(direction);
        VectorXd move = dof_map.expand(direction);
        contact.solve_forces(q, move);
        VectorXd end = q;
        const double alpha = newton_.apply_increment(end, move, min_projective_step, report);
        if (alpha < 0.0) return report;
        VectorXd ahead =
            alpha < 1.0 || last_round(report) ? VectorXd(end - q) : VectorXd(anderson.next(end, move) - q);
        if (newton_.apply_increment(q, ahead, min_projective_step, report) < 0.0) return report;
        target = *proximal.target;
        for (Index k = 0; k < model_.n_coordinates(); ++k)
            if (contact.forces()[k] != 0.0) target[k] += contact.forces()[k] / (*proximal.weights)[k];
        newton_.evaluate(q, load_parameters, proximal);
    }
}

}  // namespace magshell
