#include "magshell/solve/newton.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>

#include "magshell/solve/landing.h"

namespace magshell {
namespace {

constexpr double round_off = std::numeric_limits<double>::epsilon();

// |part| / (|magnitude| + floor / tolerance): below the tolerance when the residual is small beside the
// forces that cancel in it, or within the round-off of the forces that cancel inside the strains.
double relative(const VectorXd& part, const VectorXd& magnitude, const VectorXd& cancelling,
                double tolerance) {
    if (part.size() == 0) return 0.0;
    const double scale = magnitude.norm() + 4.0 * round_off / tolerance * cancelling.norm();
    const double length = part.norm();
    if (!std::isfinite(length) || !std::isfinite(scale)) return std::numeric_limits<double>::infinity();
    return scale > 0.0 ? length / scale : length > 0.0 ? 1.0 : 0.0;
}

// Of the extent: a step after which an iteration may end, and one under the floor of round-off.
constexpr double settled_step = 1e-3, last_under_floor = 1e-5;
// An iteration that will converge does so from its sixth step on with steps that shrink; that of a sheet, with few
// unstable directions. A solid that a first step has stretched too far has as many as its mesh has modes across it, and
// none after the next one.
constexpr Index most_new_negative_pivots = 10;
constexpr int settling_iterations = 6;
constexpr double shrinking = 0.7;
// One that settles, as in the plane of a sheet, may pass a state that is not stable.
constexpr double settling = 0.3;
// Its second step may be longer than its first, in the plane of which a sheet was flat, and not beyond all bounds.
constexpr double growing = 4.0;
// Of what its first step moved: no more is left where one ends that need not end in place.
constexpr double little_left = 1e-3;
// A residual that shrinks less makes the next step a cautious one.
constexpr double contracting = 0.5;

// What is left of the forces where obstacles have changed the matrix since its factorization.
constexpr double small_change = 0.1;

// A shorter share of a step than that leads nowhere.
constexpr double shortest_share = 1e-4;

// How exactly to solve for a Newton step with an unsymmetric matrix: what its quadratic convergence deserves,
// and no more than the end needs.
double deserved(double residual, double tolerance) {
    return std::max(0.1 * tolerance / residual, std::min(1e-2, residual));
}

// A Hessian changes as much as the sheet has moved, of its thickness. A mixed step's stresses are off by the
// square of the step before: negligible after a small move.
constexpr double negligible_move = 1e-7, small_move = 1e-4;

// Friction keeps its normal forces while it lives, also where an interruption ends that.
class HeldForces {
  public:
    explicit HeldForces(Model& model) : model_(model) { model_.hold_forces(true); }
    HeldForces(const HeldForces&) = delete;
    HeldForces& operator=(const HeldForces&) = delete;
    ~HeldForces() { model_.hold_forces(false); }

  private:
    Model& model_;
};

}  // namespace

Newton::Newton(Model& model, const NewtonOptions& options, Watch watch)
    : model_(model), options_(options), watch_(std::move(watch)) {}

std::shared_ptr<Factor> Newton::release_factor() {
    return std::exchange(factor_, nullptr);
}

VectorXd Newton::gradient(const VectorXd& q, const Anchor& anchor) const {
    VectorXd g = model_.residual().gradient;
    if (anchor.weights) g += anchor.weights->cwiseProduct(q - *anchor.target);
    return g;
}

double Newton::relative_residual(const VectorXd& q, const Anchor& anchor, bool with_floor) const {
    const Reduction& reduction = model_.reduction();
    // Held components have no residual of their own; those of framed nodes are told apart in their frames.
    const VectorXd free = reduction.project(gradient(q, anchor));
    const Index nodes = model_.nodes().first_scalar(), rotations = model_.nodes().scalars;
    VectorXd magnitude = model_.residual().magnitude;
    if (anchor.weights) magnitude += anchor.weights->cwiseProduct(q - *anchor.target).cwiseAbs();
    VectorXd cancelling = model_.cancelling_forces(q);
    // In the inertia of a short step, positions cancel; links at the end of long arms know theirs less exactly.
    if (anchor.weights) cancelling += anchor.weights->cwiseProduct(q).cwiseAbs();
    if (const VectorXd rounding = with_floor ? reduction.rounding(q) : VectorXd(); rounding.size() > 0) {
        const double reach = q.head(model_.n_coordinates()).lpNorm<Eigen::Infinity>();
        if (reach > 0.0) cancelling += model_.cancelling_forces(q).cwiseProduct(rounding) / reach;
        if (anchor.weights) cancelling += anchor.weights->cwiseProduct(rounding).cwiseAbs();
    }
    model_.add_cancelling_forces_here(anchor.motion != nullptr, cancelling);
    if (!with_floor) cancelling.setZero();
    return std::max(
        relative(free.head(nodes), magnitude.head(nodes), cancelling.head(nodes), options_.tolerance),
        relative(free.tail(rotations), magnitude.tail(rotations), cancelling.tail(rotations),
                 options_.tolerance));
}

void Newton::evaluate(const VectorXd& q, const Controls& controls, const Anchor& anchor) {
    model_.evaluate(q, controls);
    if (anchor.motion && model_.has_forces()) model_.evaluate_forces(q, controls, *anchor.motion);
}

void Newton::assemble(const VectorXd& q, const Controls& controls, bool extrapolated_stress,
                      const Anchor& anchor, bool cautious) {
    model_.assemble(q, controls, extrapolated_stress, cautious);
    if (anchor.motion && model_.has_forces()) model_.assemble_forces(controls, cautious);
    unsymmetric_ = model_.unsymmetric();
}

VectorXd Newton::left_of(const VectorXd& move, double share, const VectorXd& q,
                         const Controls& controls) const {
    if (!model_.reduction().drives()) return (1.0 - share) * move;
    return model_.reduction().prescribed_increment(q, controls);  // along curves
}

bool Newton::still_holds(const VectorXd& q, const Controls& controls) {
    evaluate(q, controls, {});
    const bool in_place = model_.reduction().prescribed_increment(q, controls).isZero(0.0);
    return in_place && relative_residual(q, {}) <= options_.tolerance;
}

NewtonReport Newton::solve(VectorXd& q, const Controls& controls, const Anchor& anchor) {
    return solve(q, controls, anchor, options_.max_iterations);
}

NewtonReport Newton::solve(VectorXd& q, const Controls& controls, const Anchor& anchor, int max_iterations) {
    if (!model_.has_body_contact()) return iterate(q, controls, anchor, max_iterations, options_.mixed, {});
    constexpr int searched = 5;  // times as many iterations
    const VectorXd from = q;
    const Model::Turns turns = model_.turns();
    NewtonReport report = iterate(q, controls, anchor, max_iterations, options_.mixed, {});
    if (report.converged || !report.touched) return report;
    const int iterations = report.iterations;
    // Short steps behind what was in the way would be taken again; others may have led anywhere.
    if (report.blocked.empty()) {
        q = from;
        model_.set_turns(turns);
    }
    report = solve_searching(q, controls, anchor, searched * max_iterations);
    report.iterations += iterations;
    if (!report.converged) tell_contact(report);
    return report;
}

NewtonReport Newton::solve_plain(VectorXd& q, const Controls& controls, const Anchor& anchor) {
    return iterate(q, controls, anchor, options_.max_iterations, false, {});
}

bool Newton::negligible(const VectorXd& step) const {
    return step.head(model_.n_coordinates()).lpNorm<Eigen::Infinity>() <=
           negligible_move * model_.length_scale();
}

NewtonReport Newton::solve_wary(VectorXd& q, const Controls& controls, const LoadStep& load) {
    return iterate(q, controls, {}, options_.max_iterations, options_.mixed, load, true);
}

NewtonReport Newton::solve_load(VectorXd& q, const Controls& controls, const LoadStep& load) {
    return iterate(q, controls, {}, options_.max_iterations, options_.mixed, load);
}

// With friction held, the stage is a minimization, which damped steps do not leave. Normal forces follow,
// until Newton finds the rest of the way.
NewtonReport Newton::solve_damped(VectorXd& q, const Controls& controls, const Anchor& anchor) {
    constexpr int most_rounds = 12, most_steps = 20, last_steps = 8;
    constexpr double least_gain = 1e-2;  // than a round began, it ends at least
    NewtonReport report;
    VectorXd move = model_.reduction().prescribed_increment(q, controls);
    if (!move.isZero(0.0) && advance(q, move, 1.0, report) < 0.0) return report;
    evaluate(q, controls, anchor);
    for (int round = 0; round < most_rounds; ++round) {
        const double enough = std::max(options_.tolerance, least_gain * relative_residual(q, anchor));
        if (!descend(q, controls, anchor, enough, most_steps, report)) return report;
        VectorXd end = q;
        const NewtonReport last = iterate(end, controls, anchor, last_steps, false, {});
        report.iterations += last.iterations;
        if (last.converged) {
            q = std::move(end);
            report.converged = true;
            report.residual = last.residual;
            return report;
        }
        evaluate(q, controls, anchor);
    }
    report.residual = relative_residual(q, anchor);
    report.reason = "no convergence in " + std::to_string(most_rounds) + " rounds of shortened steps";
    return report;
}

bool Newton::descend(VectorXd& q, const Controls& controls, const Anchor& anchor, double enough,
                     int most_steps, NewtonReport& report) {
    constexpr double shortest = 1.0 / 4096.0;  // of a step
    const HeldForces held(model_);
    double last_residual = std::numeric_limits<double>::infinity();
    for (int k = 0; k < most_steps; ++k, ++report.iterations, ++iterations_) {
        report.residual = relative_residual(q, anchor);
        watch(report.residual);
        if (report.residual <= enough) return true;
        if (!std::isfinite(report.residual)) {
            report.reason = "the iteration diverged";
            return false;
        }
        Eigen::MatrixXd no_moves(q.size(), 0);
        const bool cautious = report.residual > contracting * last_residual;
        last_residual = report.residual;
        const FactorReport factor = factorize(q, controls, false, anchor, no_moves, cautious);
        if (!factor.succeeded) {
            report.reason = factor.reason;
            return false;
        }
        const VectorXd step = solve_with_factor(-gradient(q, anchor)), from = q;
        const auto length = [&](const VectorXd& p) {
            return std::sqrt(p.dot(anchor.weights->cwiseProduct(p)));
        };
        const double whole = length(step);
        for (double share = model_.has_body_contact() ? model_.share_of_step(q, step) : 1.0;; share *= 0.5) {
            q = from;
            model_.reduction().advance(q, share * step);
            evaluate(q, controls, anchor);
            if (share <= shortest || relative_residual(q, anchor) <= enough) break;
            if (length(solve_with_factor(-gradient(q, anchor))) <= (1.0 - 0.25 * share) * whole) break;
        }
    }
    return true;
}

bool Newton::factor_serves(double contraction, double residual, double last_step) const {
    constexpr double worth = 4.0;  // steps with an old factorization, for one with its own
    // The errors that a factorization leaves behind are those of its own place, twice what the last step
    // left; in bending, as much as the sheet has moved since, of its thickness.
    const double each = std::max(2.0 * contraction, last_step / model_.length_scale());
    return each < 0.1 && std::log(options_.tolerance / residual) >= worth * std::log(each);
}

double Newton::obstacles_change(const VectorXd& step) const {
    if (!model_.has_contact()) return 0.0;
    const ContactTerm& contact = *model_.contact();
    VectorXd forces = VectorXd::Zero(step.size());
    const auto add = [&](const std::vector<ContactTerm::ActiveContact>& touching, double sign) {
        for (const ContactTerm::ActiveContact& touch : touching) {
            const Vec3& n = touch.at.normal;
            const double pushed = touch.stiffness * n.dot(contact.at_point(touch, step.data()));
            contact.distribute(touch, Vec3(sign * pushed * n), forces);
        }
    };
    add(contact.evaluated_contacts(), 1.0);
    add(touched_, -1.0);
    return forces.norm();
}

NewtonReport Newton::iterate(VectorXd& q, const Controls& controls, const Anchor& anchor, int max_iterations,
                             bool mixed, const LoadStep& load, bool wary) {
    NewtonReport report;
    if (load.factor) report.factor = *load.factor;
    Index first_negative_pivots = report.factor.negative_pivots;
    VectorXd move = model_.reduction().prescribed_increment(q, controls);
    bool extrapolated = false;
    double last_step = 0.0, step_before = 0.0, last_residual = std::numeric_limits<double>::infinity();
    double moved = std::numeric_limits<double>::infinity();  // since the last factorization
    LastStep last;
    const auto fail = [&](std::string reason) {
        report.reason = std::move(reason);
        return report;
    };
    if (std::string reason = model_.refusal(q); !reason.empty()) return fail(std::move(reason));
    if (mixed && load.last && load.last->step.size() > 0) {
        evaluate(load.last->from, controls, anchor);
        model_.extrapolate(load.last->step);
        extrapolated = true;
    }
    evaluate(q, controls, anchor);
    for (;; ++report.iterations, ++iterations_) {
        report.touched |= model_.touches();
        report.residual = relative_residual(q, anchor);
        watch(report.residual);
        if (!std::isfinite(report.residual) || last_step > 1e3 * model_.extent())
            return fail("the iteration diverged");
        const bool in_place = move.isZero(0.0);
        const bool settled =
            report.residual <= options_.tolerance && last_step <= settled_step * model_.extent();
        // Under the floor, small forces that move a thin sheet far are lost in larger ones: a step tells them.
        if (in_place && settled &&
            ((report.iterations > 0 && last_step <= last_under_floor * model_.extent()) ||
             relative_residual(q, anchor, false) <= options_.tolerance)) {
            report.converged = true;
            report.in_place = moved <= negligible_move * model_.length_scale();
            return report;
        }
        // Steps that shrink by squares say what is left. Beside the thickness it must be small: it stretches the sheet.
        if (load.roughly && in_place && report.iterations > 1 && last_step <= settling * step_before &&
            last_step * last_step * last_step <=
                std::min(little_left * report.first_length, 0.1 * model_.length_scale()) * step_before *
                    step_before &&
            report.factor.negative_pivots <= first_negative_pivots) {
            report.converged = report.rough = true;
            report.last = std::move(last);
            return report;
        }
        if (report.iterations == max_iterations)
            return fail("no convergence in " + std::to_string(max_iterations) + " iterations");
        Eigen::MatrixXd pull = move;
        const double contraction = report.residual / last_residual;
        last_residual = report.residual;
        // False where there is no matrix to go on with, and the report says why.
        const auto renew = [&] {
            // Before the first step a liquid's pressure is that of a volume that it is not to have.
            const bool begins =
                mixed && !extrapolated && model_.n_muscles() == 0 && !model_.has_body_contact();
            const bool cautious = begins || contraction > contracting;
            report.factor = factorize(q, controls, mixed && extrapolated, anchor, pull, cautious);
            report.reason = report.factor.reason;
            if (!report.factor.succeeded) return false;
            const Index negative_pivots = report.factor.negative_pivots;
            if (report.iterations == 0) first_negative_pivots = negative_pivots;
            report.lost = model_.bodies().solids().empty() &&
                          negative_pivots > first_negative_pivots + most_new_negative_pivots;
            if (mixed && report.lost) report.reason = "the iteration lost its way";
            if (mixed && report.lost) return false;
            // Of a matrix that leaves out what is negative, no pivot tells whether a state is stable.
            const bool exact = !cautious || (model_.n_muscles() == 0 && !model_.has_body_contact() &&
                                             model_.low_rank().empty());
            moved = exact && last_step <= small_move * model_.length_scale()
                        ? 0.0
                        : std::numeric_limits<double>::infinity();
            return true;
        };
        const bool kept = report.iterations == 0 ? load.factor && in_place
                                                 : factor_serves(contraction, report.residual, last_step);
        if (!kept && !renew()) return report;
        // Loads at rest leave a remainder of few nodes, which takes few vectors: no digit is given away.
        const VectorXd force = -gradient(q, anchor) - pull.col(0);
        const auto solved = [&]() -> VectorXd {
            return move + (anchor.motion
                               ? solve_with_factor(force, deserved(report.residual, options_.tolerance))
                               : solve_with_factor(force));
        };
        VectorXd step = solved();
        if (kept && in_place && obstacles_change(step) > small_change * force.norm()) {
            if (!renew()) return report;
            step = solved();
        }
        const VectorXd from = model_.has_body_contact() && in_place ? q : VectorXd();
        if (load.roughly) last.from = q;
        const bool bends = load.bend && report.iterations == 0 && in_place;
        if (bends) report.tangent = step;
        if (const VectorXd more = bends ? load.bend(step) : VectorXd(); more.size() > 0) step += more;
        double share = advance(q, step, shortest_share, report);
        if (share < 0.0) return report;
        if (from.size() > 0) {
            double part = part_into_contact(from, step, share, force.dot(step));
            if (part > 1.0) part = std::max(1.0, part * model_.share_of_step(from, part * step));
            if (part != 1.0) {
                share *= part;
                step *= part;
                q = from;
                model_.reduction().advance(q, step);
            }
        }
        if (anchor.motion && model_.has_contact())
            if (const VectorXd more = landing(model_, q, controls, *anchor.weights, after_step(model_, step));
                more.size() > 0) {
                model_.reduction().advance(q, more);
                step += more;
            }
        move = left_of(move, share, q, controls);
        const double length = step.head(model_.n_coordinates()).lpNorm<Eigen::Infinity>();
        if (report.iterations == 0) report.first_length = length;
        if (wary && report.iterations > 0 &&
            length > std::max(settling * last_step, 1e-3 * model_.extent()) &&
            (report.factor.negative_pivots > first_negative_pivots ||
             (report.iterations == 1 && length > growing * std::max(last_step, model_.extent()))))
            return fail("the iteration leaves the stable states");
        if (mixed && report.iterations >= settling_iterations && length > shrinking * last_step &&
            length > 1e-3 * model_.extent())
            return fail("the steps of the iteration do not get shorter");
        if (mixed) model_.extrapolate(bends ? report.tangent : step);
        extrapolated = true;
        if (load.roughly) last.step = step;
        step_before = last_step;
        last_step = length;
        moved += length;
        evaluate(q, controls, anchor);
    }
}

}  // namespace magshell
