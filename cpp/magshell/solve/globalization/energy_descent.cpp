#include "magshell/solve/globalization/energy_descent.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>

#include "magshell/solve/globalization/energy_descent_base.h"
#include "magshell/solve/globalization/lbfgs_descent.h"

namespace magshell {
namespace {

// Largest number of Newton iterations in a gradient flow step, and of L-BFGS steps per factorization; see
// test_a_semi_cylinder_pulled_and_pushed.
constexpr int max_flow_iterations = 6, max_lbfgs_steps = 20;
// [-] Rate 1/dt of a gradient flow step, over the size of the most negative eigenvalue; above 1, so that H + M/dt is positive definite. See
// test_a_compressed_strip_leaves_the_saddle.
constexpr double rate_above_instability = 1.1;
// [-] Largest and smallest trust radius of a gradient flow step, over the extent; see test_a_semi_cylinder_pulled_and_pushed.
constexpr double longest = 0.3, shortest = 1e-3;
// [-] A gradient flow step has converged once a Newton iteration is shorter than this fraction of its longest one; see
// test_a_semi_cylinder_pulled_and_pushed.
constexpr double flow_tolerance = 1e-2;
// Number of gradient flow steps of decreasing length that are tried before L-BFGS: by default; if gradient flow decreased the energy more per
// factorization than L-BFGS; and if L-BFGS is preferred (lbfgs_preference). See test_both_sides_of_a_saddle_cost_the_same.
constexpr int tries = 2, more_tries = 5, fewer_tries = 1;
// Number of negative pivots of the Hessian from which on L-BFGS is tried first; see test_a_flat_strip_far_beyond_where_it_buckles.
constexpr Index many_directions = 4;
// Largest number of steps for which the worse method is skipped (exponential back-off); see test_a_semi_cylinder_pulled_and_pushed.
constexpr int max_backoff = 16;
// [-] The shortest length at which a gradient flow step failed limits the trust radius: the limit over that length, and the factor by which
// that length grows with every success; see test_a_semi_cylinder_pulled_and_pushed.
constexpr double below_failed_length = 0.75, failed_length_growth = 1.2;
// [-] L-BFGS is preferred if its decrease of the energy per factorization is more than this many times that of gradient flow; see
// test_both_sides_of_a_saddle_cost_the_same.
constexpr double lbfgs_preference = 4.0;
// [-] Length of a Newton step, over the extent, below which Newton's method is tried to finish the descent; see
// test_a_compressed_strip_leaves_the_saddle.
constexpr double near = 0.05;
// [-] Length of a Newton step, over the extent, below which the change of the energy is lost in round-off; see
// test_small_load_on_a_shallow_roof.
constexpr double round_off = 1e-6;
// [-] The first nonzero rate of a gradient flow step is the larger of these fractions of forced_rate() and of largest_stiffness(); see
// test_both_sides_of_a_saddle_cost_the_same.
constexpr double first_forced_rate = 1e-3, first_stiffness_rate = 1e-12;
// [-] A gradient flow step fails if less than this fraction of a Newton iteration leads to a state that has an energy; see
// test_landing_solid_is_not_inverted.
constexpr double min_flow_alpha = 1e-4;

/// The success of one of the two methods, and the number of steps for which it is skipped (exponential back-off).
struct MethodScore {
    double decrease_per_factorization = 0.0;  // [J] in its last step
    bool slower = false;                      // whether that was less than in the step before
    bool known = false;                       // whether the method has been tried
    int backoff = 0, next_backoff = 1;  // steps for which it is skipped: now, and after its next failure

    /// Records the decrease of the energy per factorization [J] of a step.
    void record(double more) {
        slower = more < decrease_per_factorization;
        decrease_per_factorization = more;
    }

    /// Returns true if the method may be tried in this step; otherwise counts the step as skipped.
    bool is_due() { return backoff == 0 || --backoff < 0; }
    void back_off() {
        backoff = next_backoff;
        next_backoff = std::min(4 * next_backoff, max_backoff);
    }
};

// The descent of descend_to_stable(); the header says how it works.
class PostBucklingDescent : private EnergyDescent {
  public:
    PostBucklingDescent(Newton& newton, VectorXd& q, const LoadParameters& load_parameters)
        : EnergyDescent(newton, q, load_parameters),
          trust_radius_(longest * model_.extent()),
          newton_radius_(near * model_.extent()) {}

    RelaxationReport run(int max_steps) {
        return run_loop(max_steps, [&] { return assess(); }, [&] { return advance(); });
    }

  private:
    // Assesses the state q by its Hessian. Returns false if the descent is finished. Otherwise sets the rate 1/dt of the next step: 0 (a
    // Newton step) if the Hessian is positive definite, so that its factorization can be used.
    bool assess() {
        const FactorReport factor = factor_ = newton_.factorize_at(q_, load_parameters_);
        const double residual = newton_.relative_residual(q_, {});
        is_stationary_ = residual <= newton_.options().tolerance;
        has_negative_curvature_ = false;
        if (!factor.succeeded) return continue_without_factor(factor, is_stationary_);
        if (factor.negative_pivots > 0) {
            mode_ = most_unstable_mode(newton_, q_, load_parameters_, factor.negative_pivots);
            rate_ = rate_above_instability * std::abs(mode_.eigenvalue);
            has_negative_curvature_ = mode_.eigenvalue < 0.0;
            if (has_negative_curvature_) report_.descent_direction = mode_.shape;
            return true;
        }
        rate_ = 0.0;
        report_.descent_direction.resize(0);
        report_.residual = residual;
        // The residual of a thin shell may be at the level of its round-off far from equilibrium. So either the residual is small without
        // allowance for round-off, or a Newton solve confirms the equilibrium.
        report_.converged =
            newton_.relative_residual(q_, {}, false) <= newton_.options().tolerance || newton_converges();
        return !report_.converged;
    }

    // Returns true if Newton's method converges from q, where the Hessian is positive definite, to an acceptable equilibrium. It is tried if
    // its first step is short, and otherwise in the 2nd, 4th, 8th, ... such state.
    bool newton_converges() {
        const double expected = length(newton_.solve_with_factor(-newton_.gradient(q_, {})));
        if (++assessments_ == next_newton_)
            next_newton_ *= 2;
        else if (expected > newton_radius_)
            return false;
        if (finish_from_here(expected)) return true;
        newton_radius_ = 0.25 * expected;
        if (!newton_.factorize_at(q_, load_parameters_).succeeded) rate_ = forced_rate();
        return false;
    }

    // Solves by Newton's method from q. Accepts a stable result that has a lower energy, or that is as near as the first Newton step
    // predicts if this step is too short for the energy to tell. expected: length of the first Newton step [m].
    bool finish_from_here(double expected) {
        return finish_with_newton(
            [&](VectorXd& trial) {
                return newton_.solve(trial, load_parameters_,
                                     {.stop_on_instability = true, .factor = &factor_});
            },
            [&](const NewtonReport& report, const VectorXd& trial) {
                const bool there =
                    expected <= round_off * model_.extent() && length(trial - q_) <= 3.0 * expected;
                return report.factor.negative_pivots == 0 &&
                       (there || lowers(model_.energy(trial, load_parameters_)));
            });
    }

    // Takes a step by the better method, or by the other one if it fails, and records how much each decreases the energy per factorization.
    // On a saddle, displaces q along the unstable mode first. Returns false if no step lowers the energy.
    bool advance() {
        const bool definite = rate_ == 0.0;
        const double before = energy_, first_rate = rate_;
        int factorizations = newton_.factorizations() - 1;
        const auto decrease_per_factorization = [&] {
            return (before - energy_) / (newton_.factorizations() - factorizations);
        };
        if (has_negative_curvature_ && is_stationary_) push_off_saddle();
        newton_.evaluate(q_, load_parameters_, {});
        if (!definite && !factorize_definite()) return false;
        if (has_negative_curvature_ && !is_stationary_ && rate_ == first_rate &&
            last_displacement_ < settled_ && length(newton_step()) < settled_) {
            push_off_saddle();
            newton_.evaluate(q_, load_parameters_, {});
            if (!factorize_definite()) return false;
        }
        // With many directions of negative curvature L-BFGS goes first, because gradient flow follows only the fastest growing of
        // them. With few directions gradient flow goes first, because it leaves a saddle exponentially fast.
        const bool doubtful =
            flow_.slower || (factor_.succeeded && factor_.negative_pivots >= many_directions);
        const bool strides_first = flow_.is_due() && !(doubtful && lbfgs_.is_due());
        bool found = false;
        if (strides_first) {
            const double radius = trust_radius_;
            if (!try_flow_steps(found)) return false;
            if (found && std::exchange(stretched_, false)) {
                trust_radius_ = std::max(trust_radius_, radius);
                failed_length_ = std::numeric_limits<double>::infinity();
                lbfgs_.backoff = std::max(lbfgs_.backoff, 1);
                return true;
            }
            if (found) flow_.record(decrease_per_factorization());
            flow_.known = true;
            if (!found || lbfgs_is_better())
                flow_.back_off();
            else
                flow_.next_backoff = 1;
            if (found) return true;
            factorizations = newton_.factorizations() - 1;
        }
        if (!lbfgs_slide()) return !strides_first && try_flow_steps(found) && found;
        lbfgs_.record(decrease_per_factorization());
        stretched_ = true;
        if (flow_.known && lbfgs_is_better()) return true;
        flow_.backoff = 0;
        lbfgs_.back_off();
        return true;
    }

    bool lbfgs_is_better() const {
        return lbfgs_.decrease_per_factorization > lbfgs_preference * flow_.decrease_per_factorization;
    }

    void push_off_saddle() { energy_ = std::min(energy_, leave_saddle(mode_)); }

    VectorXd newton_step() const { return newton_.solve_with_factor(-newton_.gradient(q_, {})); }

    // Multiplies the rate, or sets the first one if it is 0. Returns false if steps at the new rate would be useless.
    bool raise_rate(double times = 4.0) {
        rate_ = rate_ > 0.0
                    ? times * rate_
                    : std::max(first_forced_rate * forced_rate(), first_stiffness_rate * largest_stiffness());
        return is_sensible(rate_);
    }

    // Factorizes H + rate M, and raises the rate until this matrix is positive definite. The model must have been evaluated at q. Returns
    // false if the rate becomes too large.
    bool factorize_definite() {
        Eigen::MatrixXd no_moves(q_.size(), 0);
        for (double times = 4.0;; times *= 4.0) {
            const VectorXd weights = rate_ * model_.metric();
            const FactorReport factor =
                newton_.factorize(q_, load_parameters_, false, {&weights, &q_}, no_moves);
            if (factor.succeeded && factor.negative_pivots == 0) return true;
            if (!raise_rate(times)) return false;
        }
    }

    // Raises the rate so that the Newton step, which is p now, becomes about as long as the trust radius, and factorizes.
    bool shorten_to_radius(const VectorXd& p) {
        const double stiffness = -newton_.gradient(q_, {}).dot(p) / p.dot(model_.metric().cwiseProduct(p));
        const double more = stiffness * (length(p) / trust_radius_ - 1.0);
        if (more > 0.0 && std::isfinite(more))
            rate_ += more;
        else if (!raise_rate())
            return false;
        return factorize_definite();
    }

    // Tries a limited number of gradient flow steps of decreasing length until one succeeds; `found` tells whether one did. Returns false
    // if the rate becomes too large.
    bool try_flow_steps(bool& found) {
        const double radius = trust_radius_;
        const bool proven = lbfgs_.decrease_per_factorization > 0.0 &&
                            flow_.decrease_per_factorization >= lbfgs_.decrease_per_factorization;
        const int most = proven ? more_tries : lbfgs_is_better() ? fewer_tries : tries;
        for (int k = 0; k < most; ++k) {
            VectorXd p = newton_step();
            if (length(p) > 1.5 * trust_radius_) {
                if (!shorten_to_radius(p)) return false;
                p = newton_step();
            }
            const double whole = length(p);
            if (gradient_flow_step(p)) {
                failed_length_ *= failed_length_growth;
                trust_radius_ = std::min({std::max(2.0 * trust_radius_, 4.0 * last_displacement_),
                                          below_failed_length * failed_length_, longest * model_.extent()});
                found = true;
                return true;
            }
            failed_length_ = std::max(std::min(failed_length_, whole), shortest * model_.extent());
            trust_radius_ = std::max(0.25 * std::min(whole, trust_radius_), shortest * model_.extent());
            if (!shorten_to_radius(p)) return false;
        }
        trust_radius_ = std::min(4.0 * trust_radius_, radius);
        return true;
    }

    // Takes an implicit Euler step of the gradient flow by mixed Newton iterations, of which p is the first. Returns false, and leaves q as it
    // was, if the iterations do not converge, the energy does not fall, or a point would pass through an obstacle.
    bool gradient_flow_step(VectorXd p) {
        const VectorXd from = q_, weights = rate_ * model_.metric();
        const ProximalTerm proximal{&weights, &from};
        const Model::AngleBranches angle_branches = model_.angle_branches();
        VectorXd trial = q_;
        Eigen::MatrixXd no_moves(q_.size(), 0);
        NewtonReport report;
        double last = 0.0, whole = 0.0;
        bool settles = false;
        for (int k = 0; k < max_flow_iterations && !settles; ++k, newton_.count_iteration()) {
            if (k > 0) {
                const FactorReport factor =
                    newton_.factorize(trial, load_parameters_, newton_.options().mixed, proximal, no_moves);
                if (!factor.succeeded || factor.negative_pivots > 0) break;
                p = newton_.solve_with_factor(-newton_.gradient(trial, proximal));
            }
            const double each = length(p);
            if (!(each <= model_.extent()) || (k > 1 && each > last)) break;
            if (newton_.apply_increment(trial, p, min_flow_alpha, report) < 0.0) break;
            if (newton_.options().mixed) model_.extrapolate(p);
            newton_.evaluate(trial, load_parameters_, proximal);
            newton_.watch(newton_.relative_residual(trial, proximal));
            last = each;
            whole = std::max(whole, each);
            settles = k > 0 && each < flow_tolerance * whole;
        }
        const double energy = settles ? model_.energy(trial, load_parameters_) : 0.0;
        if (!settles || !lowers(energy) || crosses_obstacle(trial)) {
            model_.set_angle_branches(angle_branches);
            newton_.evaluate(q_, load_parameters_, {});
            return false;
        }
        q_ = trial;
        energy_ = energy;
        last_displacement_ = report_.last_displacement = length(trial - from);
        return true;
    }

    // Descends by L-BFGS steps with the last factorization; raises the rate until they move the bodies. Returns false if the rate becomes
    // too large.
    bool lbfgs_slide() {
        // [-] Displacement over the extent below which the L-BFGS steps count as failed; see test_both_sides_of_a_saddle_cost_the_same.
        constexpr double no_displacement = 1e-9;
        for (;;) {
            const double moved = lbfgs_descent(newton_, q_, energy_, load_parameters_, max_lbfgs_steps);
            if (moved > no_displacement * model_.extent()) {
                last_displacement_ = report_.last_displacement = moved;
                return true;
            }
            newton_.evaluate(q_, load_parameters_, {});
            if (!raise_rate() || !factorize_definite()) return false;
        }
    }

    // [m] shortest length at which a gradient flow step failed, increased after every success
    double failed_length_ = std::numeric_limits<double>::infinity();
    double trust_radius_;   // [m] largest length of a gradient flow step
    double newton_radius_;  // [m] largest length of a Newton step at which Newton's method is tried to finish
    FactorReport factor_;   // of the last factorization at q
    Mode mode_;             // the mode of the most negative eigenvalue, if the energy falls along it
    bool has_negative_curvature_ = false, is_stationary_ = false;
    // Whether the last step was one of L-BFGS. It leaves some membrane strain, which the next gradient flow step removes; the success of
    // that step is not recorded.
    bool stretched_ = false;
    // Number of states with a positive definite Hessian so far, and the number at which Newton's method is tried in any case.
    int assessments_ = 0, next_newton_ = 2;
    MethodScore flow_, lbfgs_;
};

}  // namespace

RelaxationReport descend_to_stable(Newton& newton, VectorXd& q, const LoadParameters& load_parameters,
                                   int max_steps) {
    return PostBucklingDescent(newton, q, load_parameters).run(max_steps);
}

}  // namespace magshell
