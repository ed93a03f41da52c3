#include "magshell/solve/downhill.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>

#include "magshell/solve/descent.h"
#include "magshell/solve/relaxing.h"

namespace magshell {
namespace {

constexpr int iterations_a_stride = 6, steps_a_slide = 20;
constexpr double above_instability = 1.1;         // the rate, over the most negative eigenvalue's size
constexpr double longest = 0.3, shortest = 1e-3;  // of the extent: the radius of strides
constexpr double has_settled = 1e-2;              // of its longest iteration: a stride's last one
// Strides, ever shorter, before a slide: at first, where strides have done better, and where slides have.
constexpr int tries = 2, more_tries = 5, fewer_tries = 1;
constexpr Index several = 4;                              // directions in which a state falls
constexpr int longest_pause = 16;                         // steps in which one of both is not tried
constexpr double below_failure = 0.75, forgetting = 1.2;  // of how long strides may be
constexpr double much_better = 4.0;  // than strides slides must be to be preferred to them
constexpr double near = 0.05;        // of the extent: a Newton step so long may be the last
constexpr double round_off = 1e-6;   // of the extent: no energy tells such a step

/// Strides or slides: what the last one gained, and in how many steps one is tried next though the others gain more.
struct Kind {
    double gain = 0.0;    // [J] a factorization
    bool slower = false;  // than the one before
    bool known = false;   // whether one has been tried
    int pause = 0, next_pause = 1;

    void gained(double more) {
        slower = more < gain;
        gain = more;
    }

    bool is_due() { return pause == 0 || --pause < 0; }
    void rest() {
        pause = next_pause;
        next_pause = std::min(4 * next_pause, longest_pause);
    }
};

class Downhill : private Relaxing {
  public:
    Downhill(Newton& newton, VectorXd& q, const Controls& controls)
        : Relaxing(newton, q, controls), radius_(longest * model_.extent()), near_(near * model_.extent()) {}

    RelaxationReport run(int max_steps) {
        return go(max_steps, [&] { return look(); }, [&] { return step(); });
    }

  private:
    // From the Hessian at q: done, or the rate of the next step, 0 where the last factorization will do.
    bool look() {
        const FactorReport factor = factor_ = newton_.factorize_at(q_, controls_);
        const double residual = newton_.relative_residual(q_, {});
        at_rest_ = residual <= newton_.options().tolerance;
        falls_ = false;
        if (!factor.succeeded) return goes_on_without(factor, at_rest_);
        if (factor.negative_pivots > 0) {
            mode_ = most_unstable_mode(newton_, q_, controls_, factor.negative_pivots);
            rate_ = above_instability * std::abs(mode_.eigenvalue);
            falls_ = mode_.eigenvalue < 0.0;
            if (falls_) report_.falling = mode_.shape;
            return true;
        }
        rate_ = 0.0;
        report_.falling.resize(0);
        report_.residual = residual;
        // Under the floor of round-off a sheet may still be far from rest: Newton's step tells.
        report_.converged = newton_.relative_residual(q_, {}, false) <= newton_.options().tolerance || ends();
        return !report_.converged;
    }

    // Whether Newton finds an equilibrium from here, where the Hessian is positive definite: tried where its step is short,
    // and ever more seldom elsewhere.
    bool ends() {
        const double expected = length(newton_.solve_with_factor(-newton_.gradient(q_, {})));
        if (++looks_ == next_end_)
            next_end_ *= 2;
        else if (expected > near_)
            return false;
        if (finish(expected)) return true;
        near_ = 0.25 * expected;
        if (!newton_.factorize_at(q_, controls_).succeeded) rate_ = forced_rate();
        return false;
    }

    bool finish(double expected) {
        return ends_by(
            [&](VectorXd& trial) { return newton_.solve_wary(trial, controls_, {.factor = &factor_}); },
            [&](const NewtonReport& report, const VectorXd& trial) {
                const bool there =
                    expected <= round_off * model_.extent() && length(trial - q_) <= 3.0 * expected;
                return report.factor.negative_pivots == 0 &&
                       (there || lowers(model_.energy(trial, controls_)));
            });
    }

    bool step() {
        const bool definite = rate_ == 0.0;
        const double before = energy_, first_rate = rate_;
        int factorizations = newton_.factorizations() - 1;
        const auto gain = [&] { return (before - energy_) / (newton_.factorizations() - factorizations); };
        if (falls_ && at_rest_) push();
        newton_.evaluate(q_, controls_, {});
        if (!definite && !factorize_definite()) return false;
        if (falls_ && !at_rest_ && rate_ == first_rate && last_move_ < settled_ &&
            length(newton_step()) < settled_) {
            push();
            newton_.evaluate(q_, controls_, {});
            if (!factorize_definite()) return false;
        }
        // Where a state falls along many directions at once, strides follow the fastest of them only. Elsewhere they leave a
        // saddle ever faster.
        const bool doubtful = stride_.slower || (factor_.succeeded && factor_.negative_pivots >= several);
        const bool strides_first = stride_.is_due() && !(doubtful && slide_.is_due());
        bool found = false;
        if (strides_first) {
            const double radius = radius_;
            if (!strides(found)) return false;
            if (found && std::exchange(stretched_, false)) {
                radius_ = std::max(radius_, radius);
                failed_ = std::numeric_limits<double>::infinity();
                slide_.pause = std::max(slide_.pause, 1);
                return true;
            }
            if (found) stride_.gained(gain());
            stride_.known = true;
            if (!found || slide_is_better())
                stride_.rest();
            else
                stride_.next_pause = 1;
            if (found) return true;
            factorizations = newton_.factorizations() - 1;
        }
        if (!slide()) return !strides_first && strides(found) && found;
        slide_.gained(gain());
        stretched_ = true;
        if (stride_.known && slide_is_better()) return true;
        stride_.pause = 0;
        slide_.rest();
        return true;
    }

    bool slide_is_better() const { return slide_.gain > much_better * stride_.gain; }

    void push() { energy_ = std::min(energy_, leave_saddle(mode_)); }

    VectorXd newton_step() const { return newton_.solve_with_factor(-newton_.gradient(q_, {})); }

    bool raise_rate(double times = 4.0) {
        rate_ = rate_ > 0.0 ? times * rate_ : std::max(1e-3 * forced_rate(), 1e-12 * largest_stiffness());
        return is_sensible(rate_);
    }

    // With the rate, raised until the matrix is positive definite. The model is evaluated at q.
    bool factorize_definite() {
        Eigen::MatrixXd no_moves(q_.size(), 0);
        for (double times = 4.0;; times *= 4.0) {
            const VectorXd weights = rate_ * model_.metric();
            const FactorReport factor = newton_.factorize(q_, controls_, false, {&weights, &q_}, no_moves);
            if (factor.succeeded && factor.negative_pivots == 0) return true;
            if (!raise_rate(times)) return false;
        }
    }

    // Raises the rate so that the step p becomes as long as the radius, and factorizes.
    bool shorten(const VectorXd& p) {
        const double stiffness = -newton_.gradient(q_, {}).dot(p) / p.dot(model_.metric().cwiseProduct(p));
        const double more = stiffness * (length(p) / radius_ - 1.0);
        if (more > 0.0 && std::isfinite(more))
            rate_ += more;
        else if (!raise_rate())
            return false;
        return factorize_definite();
    }

    // Ever shorter ones, until one is found; false where no rate leads on.
    bool strides(bool& found) {
        const double radius = radius_;
        const bool proven = slide_.gain > 0.0 && stride_.gain >= slide_.gain;
        const int most = proven ? more_tries : slide_is_better() ? fewer_tries : tries;
        for (int k = 0; k < most; ++k) {
            VectorXd p = newton_step();
            if (length(p) > 1.5 * radius_) {
                if (!shorten(p)) return false;
                p = newton_step();
            }
            const double whole = length(p);
            if (stride(p)) {
                failed_ *= forgetting;
                radius_ = std::min({std::max(2.0 * radius_, 4.0 * last_move_), below_failure * failed_,
                                    longest * model_.extent()});
                found = true;
                return true;
            }
            failed_ = std::max(std::min(failed_, whole), shortest * model_.extent());
            radius_ = std::max(0.25 * std::min(whole, radius_), shortest * model_.extent());
            if (!shorten(p)) return false;
        }
        radius_ = std::min(4.0 * radius_, radius);
        return true;
    }

    // An implicit Euler step by mixed iterations, of which p is the first.
    bool stride(VectorXd p) {
        const VectorXd from = q_, weights = rate_ * model_.metric();
        const Anchor anchor{&weights, &from};
        const Model::Turns turns = model_.turns();
        VectorXd trial = q_;
        Eigen::MatrixXd no_moves(q_.size(), 0);
        NewtonReport report;
        double last = 0.0, whole = 0.0;
        bool settles = false;
        for (int k = 0; k < iterations_a_stride && !settles; ++k, newton_.count_iteration()) {
            if (k > 0) {
                const FactorReport factor =
                    newton_.factorize(trial, controls_, newton_.options().mixed, anchor, no_moves);
                if (!factor.succeeded || factor.negative_pivots > 0) break;
                p = newton_.solve_with_factor(-newton_.gradient(trial, anchor));
            }
            const double each = length(p);
            if (!(each <= model_.extent()) || (k > 1 && each > last)) break;
            if (newton_.advance(trial, p, 1e-4, report) < 0.0) break;
            if (newton_.options().mixed) model_.extrapolate(p);
            newton_.evaluate(trial, controls_, anchor);
            newton_.watch(newton_.relative_residual(trial, anchor));
            last = each;
            whole = std::max(whole, each);
            settles = k > 0 && each < has_settled * whole;
        }
        const double energy = settles ? model_.energy(trial, controls_) : 0.0;
        if (!settles || !lowers(energy) || crosses(trial)) {
            model_.set_turns(turns);
            newton_.evaluate(q_, controls_, {});
            return false;
        }
        q_ = trial;
        energy_ = energy;
        last_move_ = report_.last_move = length(trial - from);
        return true;
    }

    bool slide() {
        constexpr double no_move = 1e-9;  // of the extent
        for (;;) {
            const double moved = descend(newton_, q_, energy_, controls_, steps_a_slide);
            if (moved > no_move * model_.extent()) {
                last_move_ = report_.last_move = moved;
                return true;
            }
            newton_.evaluate(q_, controls_, {});
            if (!raise_rate() || !factorize_definite()) return false;
        }
    }

    double failed_ = std::numeric_limits<double>::infinity();  // [m] as long as strides have failed
    double radius_, near_;  // [m] of strides, and of Newton's steps that may be the last
    FactorReport factor_;   // at q
    Mode mode_;             // the most unstable one, where the energy falls along it
    bool falls_ = false, at_rest_ = false;
    bool stretched_ = false;  // by a slide, which strides undo before they lead anywhere
    int looks_ = 0, next_end_ = 2;
    Kind stride_, slide_;
};

}  // namespace

RelaxationReport go_downhill(Newton& newton, VectorXd& q, const Controls& controls, int max_steps) {
    return Downhill(newton, q, controls).run(max_steps);
}

}  // namespace magshell
