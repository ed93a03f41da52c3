#include "magshell/solve/globalization/proximal_continuation.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <string>
#include <utility>

#include "magshell/solve/globalization/lbfgs_descent.h"
#include "magshell/solve/modes.h"
#include "magshell/solve/newton/newton_iteration.h"
#include "magshell/solve/nonsymmetric_modes.h"

namespace magshell {
namespace {

class ProximalContinuation {
  public:
    ProximalContinuation(Newton& newton, VectorXd& q, const LoadParameters& load_parameters, SolveLog& log)
        : newton_(newton),
          log_(log),
          model_(newton.model()),
          q_(q),
          load_parameters_(load_parameters),
          settled_(settled_part * model_.extent()) {}

    RelaxationReport run(int max_steps) {
        if (!begin()) {
            record("descent", 0.0, report_.reason);
            return report_;
        }
        while (assess() && report_.steps < max_steps && advance()) ++report_.steps;
        if (report_.converged || report_.neutral) return report_;
        if (report_.reason.empty())
            report_.reason = "no equilibrium after " + std::to_string(max_steps) + " relaxation steps";
        describe_failure();
        record("descent", 0.0, report_.reason);
        return report_;
    }

  private:
    // Moves prescribed nodes to their targets. Returns false, with a reason in the report, if that is impossible.
    bool begin() {
        const VectorXd move = model_.dof_map().prescribed_increment(q_, load_parameters_);
        if (model_.capabilities().has_barrier && model_.capabilities().max_step_length(q_, move) < 1.0)
            report_.reason = model_.capabilities().describe_blocked_step(q_, move);
        model_.dof_map().retract(q_, move);
        energy_ = model_.energy(q_, load_parameters_);
        if (report_.reason.empty()) report_.reason = model_.capabilities().invalid_state_reason(q_);
        return report_.reason.empty();
    }

    // Adds a step to the log, which fills in what it cost.
    void record(std::string method, double displacement, std::string failure = {}) {
        SolveStep step{.method = std::move(method), .displacement = displacement};
        if (failure.empty()) step.energy = energy_;
        step.negative_pivots = factor_.negative_pivots;
        step.failure = std::move(failure);
        log_.record(std::move(step));
    }

    bool fail(std::string reason) {
        report_.reason = std::move(reason);
        return false;
    }

    // Adds to the report in which direction the energy still falls, and whether an obstacle is in the way.
    void describe_failure() {
        const FactorReport factor = newton_.factorize_at(q_, load_parameters_);
        if (!factor.succeeded) return;
        if (step_.size() > 0) {
            VectorXd ahead = q_;
            model_.dof_map().retract(ahead, step_);
            if (crossing_reason_.empty()) crosses_obstacle(ahead);
        }
        if (!crossing_reason_.empty()) report_.reason += "; " + crossing_reason_;
        if (factor.negative_pivots == 0) return;
        const std::vector<Mode> modes =
            most_unstable_modes(newton_, q_, load_parameters_, factor.negative_pivots);
        if (modes.front().eigenvalue < 0.0) report_.descent_direction = modes.front().shape;
    }

    // Factorizes at q and computes the Newton step. Returns false if the descent is finished; the report says how.
    bool assess() {
        if (solved_) return assess_hessian(true);
        newton_.evaluate(q_, load_parameters_, {});
        report_.residual = newton_.relative_residual(q_, {});
        const bool at_rest = stationary_ || report_.residual <= newton_.options().tolerance;
        if (shift_ == 0.0 || at_rest) return assess_hessian(at_rest);
        if (!factorize_definite()) return fail("no step lowers the energy, however short");
        // The shift hides negative pivots: once steps have settled, the Hessian without it shows whether a saddle is close.
        return length(step_) >= settled_ || report_.last_displacement >= settled_ || assess_hessian(true);
    }

    // Assesses q by its Hessian: an equilibrium, a saddle, or a state to be left by a Newton step with or without a shift.
    bool assess_hessian(bool at_rest) {
        factor_ = newton_.factorize_at(q_, load_parameters_);
        // The forces of a very thin sheet vanish in round-off where steps still lower the energy.
        const bool falling = idle_steps_ == 0 && report_.last_displacement > hidden_part * model_.extent();
        if (!factor_.succeeded && !falling &&
            newton_.relative_residual(q_, {}) <= newton_.options().tolerance) {
            report_.neutral = true;
            return fail("the equilibrium is neither stable nor unstable: its stiffness matrix is singular (" +
                        factor_.reason + ")");
        }
        const bool stable =
            factor_.succeeded &&
            (factor_.negative_pivots == 0 ||
             (at_rest && !has_potential() && count_unstable_directions(newton_, factor_) == 0));
        if (stable) {
            shift_ = 0.0;
            report_.descent_direction.resize(0);
            report_.factor = factor_;
            report_.converged =
                solved_ || newton_.relative_residual(q_, {}, false) <= newton_.options().tolerance;
            if (!report_.converged) step_ = newton_step();
            return !report_.converged;
        }
        solved_ = false;
        if (factor_.succeeded && at_rest) {
            const std::vector<Mode> modes =
                most_unstable_modes(newton_, q_, load_parameters_, factor_.negative_pivots);
            const double lowest = modes.front().eigenvalue;
            // A shift above the size of the most negative eigenvalue makes H + shift M positive definite.
            shift_ = std::max(shift_, step_factor * std::abs(lowest));
            if (lowest < 0.0) leave_saddle(modes);
            newton_.evaluate(q_, load_parameters_, {});
        } else if (shift_ == 0.0) {
            raise_shift(largest_factor);
        }
        return factorize_definite() ||
               fail(factor_.succeeded ? "no step lowers the energy, however short" : factor_.reason);
    }

    // Takes one step by L-BFGS or by mixed iterations. Returns false, with a reason, if all attempts fail or too many steps are idle.
    bool advance() {
        const double before = energy_;
        for (int attempt = 0; attempt < few; ++attempt) {
            const double whole = length(step_), stiffness = slope() / square(step_);
            const bool finishes = shift_ == 0.0 && whole < settled_step * model_.extent();
            if (finishes ? reach_proximal_point() : take_step()) {
                if (shift_ > 0.0) last_shift_ = shift_;
                shift_ /= largest_factor;
                if (shift_ < negligible_part * stiffness) shift_ = 0.0;
                const bool hardly_lower =
                    has_potential() && before - energy_ <= energy_tolerance * std::abs(energy_);
                const bool idle = !solved_ && report_.last_displacement < settled_ &&
                                  (hardly_lower || !crossing_reason_.empty());
                idle_steps_ = idle ? idle_steps_ + 1 : 0;
                if (!idle) crossing_reason_.clear();
                // An obstacle may hold a body at a place where its energy still has a slope.
                return idle_steps_ < few || fail("no step lowers the energy, however short");
            }
            const bool moved = keep_best_state();
            // With the same stiffness along it, the next step is shorter by largest_factor, and no longer than the extent.
            const double shorter = std::max(largest_factor, whole / model_.extent());
            shift_ = std::max(largest_factor * shift_, shift_ + (shorter - 1.0) * stiffness);
            last_shift_ = shift_;
            if (moved) return true;
            newton_.evaluate(q_, load_parameters_, {});
            if (!factorize_definite()) break;
        }
        return fail("no step lowers the energy, however short");
    }

    // Takes a step by the method that gains more. L-BFGS is cheap, but its steps are short in a narrow curved valley of the energy. Mixed
    // iterations pass over the valley's walls (membrane energy), and go farther with every success, which lowers the shift. They are tried
    // after `few` rounds of L-BFGS, and go on while their decrease of the energy per factorization is above that of L-BFGS, or grows.
    bool take_step() {
        if (!has_potential() || model_.capabilities().has_barrier) return reach_proximal_point();
        const double before = energy_;
        const int factorizations = newton_.factorizations() - 1;
        const auto gain = [&] { return (before - energy_) / (newton_.factorizations() - factorizations); };
        if (mixed_gain_ == 0.0 && lbfgs_rounds_ < few) {
            if (!predicts_well() || !lbfgs_round()) return reach_proximal_point();
            ++lbfgs_rounds_;
            lbfgs_gain_ = gain();
            return true;
        }
        lbfgs_rounds_ = 0;
        const bool reached = reach_proximal_point();
        const double now = reached ? gain() : mixed_gain_ / largest_factor;
        const bool pays = now > lbfgs_gain_ || (reached && now > mixed_gain_);
        mixed_gain_ = pays ? now : 0.0;
        return reached;
    }

    // Returns true if the energy falls along the whole Newton step by more than good_part of what the quadratic model predicts.
    bool predicts_well() {
        const Model::AngleBranches angle_branches = model_.angle_branches();
        const double predicted = 0.5 * (slope() + shift_ * square(step_));
        VectorXd trial = q_, step = step_;
        NewtonReport ignored;
        const bool feasible = newton_.apply_increment(trial, step, settled_part, ignored) >= 0.0;
        const double energy = feasible ? model_.energy(trial, load_parameters_) : energy_;
        model_.set_angle_branches(angle_branches);
        return energy_ - energy > good_part * predicted;
    }

    // Descends by L-BFGS steps with the factorization at hand. Returns false if the energy does not fall; q then stays, up to round-off.
    bool lbfgs_round() {
        const double before = energy_;
        LbfgsRound round = lbfgs_descent(newton_, q_, energy_, load_parameters_);
        stationary_ = round.stationary;
        if (!round.crossing_reason.empty()) crossing_reason_ = std::move(round.crossing_reason);
        if (!(energy_ < before)) {
            newton_.evaluate(q_, load_parameters_, {});
            return false;
        }
        report_.last_displacement = round.displacement;
        record("L-BFGS", round.displacement);
        return true;
    }

    // Solves for the proximal point, or without a shift for the equilibrium, by mixed iterations, which begin with the Newton step at hand.
    // Returns false, and leaves q as it was, if they do not converge, leave the stable states, raise the energy by more than round-off, move
    // a node by more than the extent, or pass through an obstacle.
    bool reach_proximal_point() {
        stationary_ = false;
        const bool exact = shift_ == 0.0;
        const VectorXd from = q_, weights = shift_ * model_.metric();
        const Model::AngleBranches angle_branches = model_.angle_branches();
        VectorXd trial = q_;
        best_.resize(0);
        double lowest = energy_;
        NewtonPolicy policy{.stop_on_instability = true, .inexact = !exact, .factor = &factor_};
        if (!exact) policy.proximal = {&weights, &from};
        if (has_potential())
            policy.visit = [&](const VectorXd& there) {
                const VectorXd moved = there - from;
                if (length(moved) > model_.extent()) return;
                const double energy =
                    model_.energy(there, load_parameters_) + 0.5 * moved.dot(weights.cwiseProduct(moved));
                if (!(energy < lowest - energy_tolerance * std::abs(lowest))) return;
                lowest = energy;
                best_ = there;
                best_branches_ = model_.angle_branches();
            };
        const NewtonReport report = newton_.solve(trial, load_parameters_, policy);
        const double energy = report.converged ? model_.energy(trial, load_parameters_) : 0.0;
        // Round-off hides the change of the energy along a very short step; the state must then be as near as the step predicts.
        const double expected = length(step_);
        const bool as_expected =
            expected <= hidden_part * model_.extent() && length(trial - from) <= step_factor * expected;
        const bool too_long = length(trial - from) > model_.extent();
        const bool lower =
            !has_potential() || as_expected || energy <= energy_ + energy_tolerance * std::abs(energy_);
        // Without a potential the eigenvalues decide about stability, and only at an equilibrium.
        const bool unstable = report.factor.negative_pivots > 0 && !(exact && !has_potential());
        if (!report.converged || unstable || too_long || !lower || crosses_obstacle(trial)) {
            model_.set_angle_branches(angle_branches);
            record(exact ? "Newton" : "proximal Newton", 0.0, failure_of(report, too_long, lower));
            return false;
        }
        report_.last_displacement = length(trial - from);
        report_.residual = report.residual;
        solved_ = exact;
        q_ = std::move(trial);
        energy_ = energy;
        record(exact ? "Newton" : "proximal Newton", report_.last_displacement);
        return true;
    }

    // Says why mixed iterations were not accepted.
    std::string failure_of(const NewtonReport& report, bool too_long, bool lower) const {
        if (!report.converged) return report.reason;
        if (report.factor.negative_pivots > 0) return "the state reached is unstable";
        if (too_long) return "the step is longer than the extent of the bodies";
        return lower ? "the way passes through an obstacle" : "the energy of the state reached is higher";
    }

    // Moves to the state of least energy, with the proximal term, on the way of the last failed iteration. Returns false if there is none.
    bool keep_best_state() {
        if (best_.size() == 0 || crosses_obstacle(best_)) return false;
        report_.last_displacement = length(best_ - q_);
        q_ = std::move(best_);
        model_.set_angle_branches(best_branches_);
        energy_ = model_.energy(q_, load_parameters_);
        record("best state of the failed step", report_.last_displacement);
        return true;
    }

    struct Side {
        VectorXd q;
        double energy;
    };

    // Returns the state at which a displacement of q along `shape` ends, if the energy falls on this way or round-off hides that it
    // falls: as far as it falls, and else the shortest displacement.
    Side down_along(const VectorXd& shape) {
        const auto at = [&](double amplitude) {
            Side side{q_, std::numeric_limits<double>::infinity()};
            const VectorXd push = amplitude * shape;
            if (model_.capabilities().admissible_step_length(q_, push) < 1.0) return side;
            model_.dof_map().retract(side.q, push);
            if (!crosses_obstacle(side.q)) side.energy = model_.energy(side.q, load_parameters_);
            return side;
        };
        // A straight displacement stretches a thin shell, so the first one may have to be very short.
        double amplitude = settled_;
        Side side = at(amplitude);
        while (!(side.energy < energy_) && amplitude > hidden_part * settled_)
            side = at(amplitude *= small_part);
        for (amplitude *= step_factor; amplitude < model_.extent(); amplitude *= step_factor) {
            Side next = at(amplitude);
            if (!(next.energy < side.energy)) break;
            side = std::move(next);
        }
        return side;
    }

    // Displaces q along the lowest mode, on the side where the energy falls deeper. Notes the ways not taken where round-off decides:
    // the other side where the energy falls equally, and the next mode if its eigenvalue is equal within settled_step.
    void leave_saddle(const std::vector<Mode>& modes) {
        ++report_.saddles_escaped;
        stationary_ = false;
        report_.descent_direction = modes.front().shape;
        const Side one = down_along(modes.front().shape);
        // Contact ends every displacement early on both sides, so that depths cannot be compared.
        const bool compared = !(model_.capabilities().has_barrier && std::isfinite(one.energy));
        const Side other = compared ? down_along(-modes.front().shape) : one;
        const double equal = hidden_part * (energy_ - one.energy) + energy_tolerance * std::abs(energy_);
        const bool deeper = one.energy - other.energy > equal;
        if (compared && std::abs(one.energy - other.energy) <= equal)
            report_.other_branches.push_back({q_, other.q, false});
        if (modes.size() > 1 && modes[1].eigenvalue <= (1.0 - settled_step) * modes[0].eigenvalue)
            if (Side next = down_along(modes[1].shape); std::isfinite(next.energy))
                report_.other_branches.push_back({q_, std::move(next.q), true});
        const Side& better = deeper || !std::isfinite(one.energy) ? other : one;
        if (!std::isfinite(better.energy)) return;
        const double displacement = length(better.q - q_);
        q_ = better.q;
        energy_ = better.energy;
        record("along the lowest mode of a saddle", displacement);
    }

    // Factorizes H + shift M and computes its Newton step; raises the shift until the matrix is positive definite. The model must have
    // been evaluated at q. Returns false if the shift becomes so large that no step is left.
    bool factorize_definite() {
        Eigen::MatrixXd no_moves(q_.size(), 0);
        for (double times = largest_factor;; times *= largest_factor) {
            const VectorXd weights = shift_ * model_.metric();
            const FactorReport factor =
                newton_.factorize(q_, load_parameters_, false, {&weights, &q_}, no_moves);
            if (factor.succeeded && factor.negative_pivots == 0) {
                factor_ = factor;
                step_ = newton_step();
                return true;
            }
            raise_shift(times);
            // With a larger shift every step is shorter than settled_part of the extent.
            if (!(shift_ > 0.0 && settled_part * shift_ <= std::max(largest_stiffness(), forced_shift())))
                return false;
        }
    }

    // Multiplies the shift, or if it is zero, sets it to a fraction of the last one, or without a last one, of forced_shift().
    void raise_shift(double times) {
        if (shift_ > 0.0)
            shift_ *= times;
        else if (last_shift_ > 0.0)
            shift_ = last_shift_ / largest_factor;
        else
            shift_ = std::max(small_part * forced_shift(), energy_tolerance * largest_stiffness());
    }

    // Returns true if all forces are derivatives of the energy, which then decides which step is good. Followers and torques on ball joints
    // are not: proximal points then are the steps of pseudo-transient continuation [Kelley, Keyes 1998].
    bool has_potential() const { return !newton_.is_unsymmetric(); }

    VectorXd newton_step() const { return newton_.solve_with_factor(-newton_.gradient(q_, {})); }
    double length(const VectorXd& p) const { return largest_displacement(model_, p); }
    double square(const VectorXd& p) const { return p.dot(model_.metric().cwiseProduct(p)); }
    double slope() const { return std::abs(newton_.gradient(q_, {}).dot(step_)); }

    // Returns true if a point would pass through an obstacle on the straight way from q to `trial`.
    bool crosses_obstacle(const VectorXd& trial) {
        std::string reason =
            model_.capabilities().crossing_reason(q_, load_parameters_, trial, load_parameters_);
        if (reason.empty()) return false;
        crossing_reason_ = std::move(reason);
        return true;
    }

    // Returns the shift [N/m3] at which the largest force per area moves a vertex by the extent against the proximal term alone.
    double forced_shift() const {
        const DofMap& dof_map = model_.dof_map();
        const VectorXd force = dof_map.vector(model_.residual().gradient),
                       area = dof_map.weights(model_.metric());
        double most = 0.0;
        for (Index k = 0; k < dof_map.size(); ++k)
            if (area[k] > 0.0) most = std::max(most, std::abs(force[k]) / area[k]);
        return most / model_.extent();
    }

    // Returns the largest diagonal entry of the last assembled Hessian per area [N/m3]; this shift holds every vertex in place.
    double largest_stiffness() const {
        const VectorXd stiffness = model_.diagonal();
        double most = 0.0;
        for (Index k = 0; k < model_.n_coordinates(); ++k)
            if (model_.metric()[k] > 0.0) most = std::max(most, std::abs(stiffness[k]) / model_.metric()[k]);
        return most;
    }

    Newton& newton_;
    SolveLog& log_;
    Model& model_;
    VectorXd& q_;
    const LoadParameters& load_parameters_;
    const double settled_;  // [m]
    RelaxationReport report_;
    double energy_ = 0.0;                    // [J] at q
    double shift_ = 0.0, last_shift_ = 0.0;  // [N/m3], now and when it was needed last
    FactorReport factor_;                    // of the last factorization, made at q
    VectorXd step_;                          // the Newton step that it gives
    VectorXd best_;  // the state of least energy on the way of the last iteration, if any
    Model::AngleBranches best_branches_;  // of the angles there
    int lbfgs_rounds_ = 0;                // in a row
    double mixed_gain_ = 0.0,
           lbfgs_gain_ = 0.0;  // [J] decrease of the energy per factorization; 0: mixed iterations do not pay
    int idle_steps_ = 0;       // in a row
    bool stationary_ = false;  // whether L-BFGS ended at q because the energy no longer falls
    bool solved_ = false;      // whether Newton's method has converged to q
    std::string crossing_reason_;  // why an obstacle refused the last step, in words; empty if none did
};

}  // namespace

RelaxationReport proximal_continuation(Newton& newton, VectorXd& q, const LoadParameters& load_parameters,
                                       int max_steps, SolveLog& log) {
    RelaxationReport report = ProximalContinuation(newton, q, load_parameters, log).run(max_steps);
    const ModelCapabilities& has = newton.model().capabilities();
    if (report.converged || !has.has_barrier || !has.invalid_state_reason(q).empty()) return report;
    // Contact may be the cause whatever the reason was, so the largest contact force is named.
    newton.evaluate(q, load_parameters, {});
    if (const std::string hardest = newton.model().contacts().describe_largest_force(); !hardest.empty())
        report.reason += "; bodies touch: " + hardest;
    return report;
}

}  // namespace magshell
