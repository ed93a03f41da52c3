// Newton's steps where not all of a step may be taken, and the search along them.
#include <algorithm>
#include <cmath>
#include <limits>

#include "magshell/solve/newton.h"

namespace magshell {
namespace {

// A residual that shrinks less makes the next matrix a cautious one.
constexpr double contracting = 0.5;
// A shorter share of a step leads nowhere.
constexpr double shortest_share = 1e-9;

}  // namespace

double Newton::advance(VectorXd& q, VectorXd& step, double shortest, NewtonReport& report) {
    const double share = model_.share_of_step(q, step);
    if (share < shortest) {
        report.reason = model_.stuck(q, step);
        return -1.0;
    }
    if (share < 1.0) step *= share;
    model_.reduction().advance(q, step);
    return share;
}

double Newton::search(VectorXd& q, const Controls& controls, const Anchor& anchor, const VectorXd& from,
                      const VectorXd& step, double slope) {
    constexpr double rising = 0.5, least = 0.1;  // of the slope at the beginning; of a cut
    constexpr int most_cuts = 12;
    double part = 1.0;
    for (int cut = 0; cut < most_cuts; ++cut) {
        const double there = -gradient(q, anchor).dot(step);
        if (there >= -rising * slope) break;
        part *= std::clamp(slope / (slope - there), least, 0.5);
        q = from;
        model_.reduction().advance(q, part * step);
        evaluate(q, controls, anchor);
    }
    return part;
}

NewtonReport Newton::solve_searching(VectorXd& q, const Controls& controls, const Anchor& anchor,
                                     int max_iterations) {
    NewtonReport report;
    report.reason = model_.refusal(q);
    if (!report.reason.empty()) return report;
    const auto fail = [&](std::string reason) {
        report.reason = std::move(reason);
        return report;
    };
    VectorXd move = model_.reduction().prescribed_increment(q, controls);
    double last_residual = std::numeric_limits<double>::infinity(), share = 1.0;
    bool was_cautious = false;
    evaluate(q, controls, anchor);
    for (;; ++report.iterations, ++iterations_) {
        report.residual = relative_residual(q, anchor);
        watch(report.residual);
        if (!std::isfinite(report.residual)) return fail("the iteration diverged");
        const bool in_place = move.isZero(0.0);
        if (in_place && report.residual <= options_.tolerance) {
            report.converged = true;
            return report;
        }
        if (report.iterations == max_iterations)
            return fail("no convergence in " + std::to_string(max_iterations) + " iterations");
        // After a cautious step that was taken whole an exact one may do, and tells whether it does.
        bool cautious = share < 1.0 || (!was_cautious && report.residual > contracting * last_residual);
        last_residual = report.residual;
        const VectorXd force = -gradient(q, anchor), from = q;
        VectorXd step;
        double slope = 0.0;
        for (;; cautious = true) {
            Eigen::MatrixXd pull = move;
            report.factor = factorize(q, controls, false, anchor, pull, cautious);
            if (!report.factor.succeeded) return fail(report.factor.reason);
            step = move + solve_with_factor(force - pull.col(0));
            slope = force.dot(step);
            if (!in_place || slope > 0.0) break;
            if (cautious) return fail("the energy does not fall along the step");
        }
        was_cautious = cautious;
        share = advance(q, step, shortest_share, report);
        if (share < 0.0) return report;
        move = left_of(move, share, q, controls);
        evaluate(q, controls, anchor);
        if (in_place) share *= search(q, controls, anchor, from, step, share * slope);
    }
}

}  // namespace magshell
