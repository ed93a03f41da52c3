// Newton's steps where not all of a step may be taken, and the search along them.
#include <algorithm>
#include <cmath>
#include <limits>

#include "magshell/solve/newton.h"
#include "magshell/term/body_contact_term.h"

namespace magshell {
namespace {

// A residual that shrinks less makes the next matrix a cautious one.
constexpr double contracting = 0.5;
// A shorter share of a step leads nowhere.
constexpr double shortest_share = 1e-9;
// Of a step, that leaves little of it: it is to be told what was in its way.
constexpr double little = 0.1;

}  // namespace

double Newton::advance(VectorXd& q, VectorXd& step, double shortest, NewtonReport& report) {
    const double share = model_.share_of_step(q, step);
    if (share < shortest) {
        report.reason = model_.stuck(q, step);
        return -1.0;
    }
    if (model_.has_body_contact()) {
        report.touched |= share < 1.0;
        report.blocked = share < little ? model_.stuck(q, step) : std::string();
    }
    if (share < 1.0) step *= share;
    model_.reduction().advance(q, step);
    return share;
}

// The energy is expected to fall ever slower along the step, and at the end of the whole one no more. What bodies that
// touch add to that, they tell alone: at the step's end, where it still falls fast (they were nearer than they will stay)
// beyond it, and, where that is too much, by secants between too far and not far enough.
double Newton::part_into_contact(const VectorXd& q, const VectorXd& step, double share, double slope) const {
    constexpr double rising = 0.5, falling = 0.5;  // of the slope at the beginning
    constexpr int most_trials = 6;
    constexpr double longest = 8.0, left = 0.2;  // steps; of the slope: less is not worth a longer one
    if (!(slope > 0.0)) return 1.0;
    const BodyContactTerm& contact = *model_.body_contact();
    const auto pushed_back = [&](double part) {
        VectorXd there = q;
        model_.reduction().advance(there, part * step);
        return contact.slope(there.data(), step.data());
    };
    const double at_begin = contact.slope(step.data()), stiffness = contact.curvature(step.data());
    const auto slope_at = [&](double part) {
        return (share * part - 1.0) * slope + pushed_back(part) - at_begin - part * stiffness;
    };
    double near = 0.0, far = 1.0, at_near = -slope, at_far = slope_at(1.0);
    while (share == 1.0 && at_far < -left * slope && far < longest) {
        near = far;
        at_near = at_far;
        far *= 2.0;
        at_far = slope_at(far);
    }
    if (at_far <= rising * slope) return far;
    for (int trial = 0; trial < most_trials; ++trial) {
        // The contact's push rises ever faster: a secant falls short. Illinois' rule halves the end that stays.
        const double part = std::clamp(near + (far - near) * at_near / (at_near - at_far),
                                       near + 0.1 * (far - near), far - 0.1 * (far - near));
        const double there = slope_at(part);
        if (there > rising * slope) {
            far = part;
            at_far = there;
            at_near *= trial > 0 ? 0.5 : 1.0;
        } else if (there < -falling * slope) {
            near = part;
            at_near = there;
            at_far *= 0.5;
        } else {
            return part;
        }
    }
    return near > 0.0 ? near : far;
}

void Newton::tell_contact(NewtonReport& report) const {
    if (!report.blocked.empty())
        report.reason += "; " + report.blocked;
    else if (const std::string hardest = model_.body_contact()->hardest(); !hardest.empty())
        report.reason += "; bodies touch: " + hardest;
}

double Newton::search(VectorXd& q, const Controls& controls, const Anchor& anchor, const VectorXd& from,
                      const VectorXd& step, double slope) {
    constexpr double enough = 0.5;  // of the slope at the beginning is left, or has come back
    constexpr int most_trials = 12;
    const auto slope_here = [&] { return gradient(q, anchor).dot(step); };
    double part = 1.0, near = 0.0, far = 1.0, at_near = -slope, at_far = slope_here();
    if (at_far <= enough * slope) return part;
    for (int trial = 0; trial < most_trials; ++trial) {
        // What touches rises ever faster: a secant falls short. Illinois' rule halves the end that stays.
        part = std::clamp(near + (far - near) * at_near / (at_near - at_far), near + 0.1 * (far - near),
                          far - 0.1 * (far - near));
        q = from;
        model_.reduction().advance(q, part * step);
        evaluate(q, controls, anchor);
        const double there = slope_here();
        if (there > enough * slope) {
            far = part;
            at_far = there;
            at_near *= trial > 0 ? 0.5 : 1.0;
        } else if (there < -enough * slope) {
            near = part;
            at_near = there;
            at_far *= trial > 0 ? 0.5 : 1.0;
        } else {
            break;
        }
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
