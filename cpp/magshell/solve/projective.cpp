#include "magshell/solve/projective.h"

#include <cmath>
#include <string>
#include <utility>

#include "magshell/solve/anderson.h"
#include "magshell/solve/secants.h"

namespace magshell {
namespace {

// A shorter share of a step than that leads nowhere.
constexpr double shortest_move = 1e-9;
// How far a node may be from where Coulomb's law has it, of the extent of the scene.
constexpr double law_tolerance = 1e-10;

// Points that begin or cease to touch make another matrix, which is looked for now and then.
constexpr int rounds_between_looks = 5;

// What changes the diagonal of the matrix by less, of what it is, secants learn.
constexpr double much = 0.5;

// What pairs add to the diagonal, by node.
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

VectorXd ProjectiveSolver::reduced_gradient(const VectorXd& q, const Anchor& anchor) const {
    return model_.reduction().vector(newton_.gradient(q, anchor));
}

bool ProjectiveSolver::touches_otherwise(const Anchor& anchor, VectorXd& before) const {
    if (!model_.has_contact()) return false;
    VectorXd now = model_.touching_stiffness();
    bool changed = false;
    for (Index node = 0; node < now.size() && !changed; ++node)
        changed = std::abs(now[node] - before[node]) >
                  much * ((*anchor.weights)[3 * node] + matrix_.stiffness(node) + before[node]);
    if (changed) before = std::move(now);
    return changed;
}

void ProjectiveSolver::prepare(const VectorXd& q, const Anchor& anchor, double scale) {
    const int factorized = matrix_.factorizations();
    matrix_.set(scale, *anchor.weights, model_.touching_stiffness());
    newton_.count_factorizations(matrix_.factorizations() - factorized);
    matrix_.linearize(q);
}

NewtonReport ProjectiveSolver::solve(VectorXd& q, const Controls& controls, const Anchor& anchor,
                                     double scale) {
    const bool touches = options_.coulomb && (model_.has_contact() || model_.has_body_contact());
    return touches ? solve_touching(q, controls, anchor, scale) : solve_rounds(q, controls, anchor, scale);
}

NewtonReport ProjectiveSolver::solve_rounds(VectorXd& q, const Controls& controls, const Anchor& anchor,
                                            double scale) {
    NewtonReport report;
    const auto fail = [&](std::string reason) {
        report.reason = std::move(reason);
        return report;
    };
    if (std::string reason = model_.refusal(q); !reason.empty()) return fail(std::move(reason));
    const Reduction& reduction = model_.reduction();
    VectorXd move = reduction.prescribed_increment(q, controls);
    newton_.evaluate(q, controls, anchor);
    prepare(q, anchor, scale);
    Secants secants(options_.history);
    VectorXd touched = model_.touching_stiffness(), between;
    // A small matrix of many pairs costs more than a round.
    const auto take_pairs = [&] {
        if (!model_.has_body_contact()) return;
        const std::vector<PairStiffness> pairs = model_.touching_pairs();
        VectorXd now = diagonal_of(pairs, model_.nodes().n_nodes());
        bool changed = between.size() == 0;
        for (Index node = 0; node < now.size() && !changed; ++node)
            changed = std::abs(now[node] - between[node]) > much * (matrix_.diagonal(node) + between[node]);
        if (!changed) return;
        touching_.set(pairs);
        between = std::move(now);
    };
    VectorXd gradient = reduced_gradient(q, anchor);
    for (;; ++report.iterations, newton_.count_iteration()) {
        const bool last = report.iterations == options_.iterations;
        const bool in_place = move.isZero(0.0);
        report.residual = newton_.relative_residual(q, anchor);
        newton_.watch(report.residual);
        if (!std::isfinite(report.residual)) return fail("the iteration diverged");
        if (in_place && options_.tolerance > 0.0 && report.residual <= options_.tolerance &&
            (report.iterations > 0 || newton_.relative_residual(q, anchor, false) <= options_.tolerance))
            report.converged = true;
        if (last && in_place && options_.tolerance == 0.0) report.converged = true;
        if (report.converged) return report;
        if (last)
            return fail("no convergence in " + std::to_string(report.iterations) +
                        " iterations of Projective Dynamics: the residual is " +
                        std::to_string(report.residual));
        if (report.iterations % rounds_between_looks == rounds_between_looks - 1 &&
            touches_otherwise(anchor, touched)) {
            prepare(q, anchor, scale);
            secants.clear();
            between.resize(0);
        }
        take_pairs();
        VectorXd direction = -gradient;
        if (!in_place) direction -= reduction.vector(matrix_.times(move));
        secants.solve(direction, [&](VectorXd& rhs) { touching_.solve(rhs); });
        double slope = -gradient.dot(direction);
        if (in_place && !(slope > 0.0) && !secants.empty()) {
            secants.clear();
            direction = -gradient;
            touching_.solve(direction);
            slope = -gradient.dot(direction);
        }
        const VectorXd from = q;
        VectorXd step = move + reduction.expand(direction);
        double share = newton_.advance(q, step, shortest_move, report);
        if (share < 0.0) return report;
        move *= 1.0 - share;
        newton_.evaluate(q, controls, anchor);
        if (in_place) share *= newton_.search(q, controls, anchor, from, step, share * slope);
        VectorXd now = reduced_gradient(q, anchor);
        if (in_place) secants.add(share * direction, now - gradient);
        gradient = std::move(now);
    }
}

// The forces of contact shift the anchor's target, so that what is left over is a residual as any other.
NewtonReport ProjectiveSolver::solve_touching(VectorXd& q, const Controls& controls, const Anchor& anchor,
                                              double scale) {
    NewtonReport report;
    const auto fail = [&](std::string reason) {
        report.reason = std::move(reason);
        return report;
    };
    const Reduction& reduction = model_.reduction();
    VectorXd first_move = reduction.prescribed_increment(q, controls);
    if (const double share = newton_.advance(q, first_move, shortest_move, report); share < 1.0)
        return fail(share < 0.0 ? report.reason : "what supports move is in the way of another body");
    if (std::string reason = model_.refusal(q); !reason.empty()) return fail(std::move(reason));
    newton_.evaluate(q, controls, anchor);
    prepare(q, anchor, scale);
    CoulombContact contact(model_, matrix_, controls, *anchor.motion->x_hat, anchor.motion->time);
    VectorXd target = *anchor.target;
    const Anchor pushed{anchor.weights, &target, anchor.motion};
    Anderson anderson(options_.history);
    const auto last_round = [&](const NewtonReport& now) {
        return now.iterations + 1 == options_.iterations;
    };
    for (;; ++report.iterations, newton_.count_iteration()) {
        report.residual = newton_.relative_residual(q, pushed);
        newton_.watch(report.residual);
        if (!std::isfinite(report.residual)) return fail("the iteration diverged");
        const bool last = report.iterations == options_.iterations;
        const double off = contact.look(q);
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
        VectorXd move = reduction.expand(direction);
        contact.settle(q, move);
        VectorXd end = q;
        const double share = newton_.advance(end, move, shortest_move, report);
        if (share < 0.0) return report;
        VectorXd ahead =
            share < 1.0 || last_round(report) ? VectorXd(end - q) : VectorXd(anderson.next(end, move) - q);
        if (newton_.advance(q, ahead, shortest_move, report) < 0.0) return report;
        target = *anchor.target;
        for (Index k = 0; k < model_.n_coordinates(); ++k)
            if (contact.forces()[k] != 0.0) target[k] += contact.forces()[k] / (*anchor.weights)[k];
        newton_.evaluate(q, controls, anchor);
    }
}

}  // namespace magshell
