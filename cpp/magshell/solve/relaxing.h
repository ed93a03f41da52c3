// What ways down in energy have in common: where they are, what they know of the rate that keeps steps short, and how they
// leave a saddle.
#pragma once

#include <limits>
#include <string>

#include "magshell/solve/modes.h"
#include "magshell/solve/relaxation.h"

namespace magshell {

class Relaxing {
  protected:
    /// At the controls, supports moved to where these want them; the report says what is wrong with that.
    Relaxing(Newton& newton, VectorXd& q, const Controls& controls);

    /// look() and step() in turns, until one of them says no: look() where the report says all, step() where none is left.
    template <class Look, class Step>
    RelaxationReport go(int max_steps, Look&& look, Step&& step) {
        if (!report_.reason.empty()) return report_;
        for (; report_.steps < max_steps; ++report_.steps) {
            if (!look()) return report_;
            if (step()) continue;
            report_.reason = "no step lowers the energy, however short";
            if (!in_the_way_.empty()) report_.reason += "; " + in_the_way_;
            return report_;
        }
        report_.reason = "not at rest after " + std::to_string(max_steps) + " steps";
        return report_;
    }

    /// Whether to go on where the Hessian could not be factorized, as of a sheet that can still turn freely: the forces say
    /// how fast it may.
    bool goes_on_without(const FactorReport& factor, bool at_rest);

    /// Newton's end of the way: whether solve(trial) converges from q to where good(report, trial) holds, which q is then.
    template <class Solve, class Good>
    bool ends_by(Solve&& solve, Good&& good) {
        VectorXd trial = q_;
        const Model::Turns turns = model_.turns();
        const NewtonReport report = solve(trial);
        if (!report.converged || !good(report, trial) || crosses(trial)) {
            model_.set_turns(turns);
            return false;
        }
        report_.residual = report.residual;
        q_ = trial;
        return true;
    }

    /// Whether a point would pass through an obstacle on the way from q to `trial`.
    bool crosses(const VectorXd& trial);
    /// [N/m3] With this rate the forces move a sheet that only the anchor holds by a twentieth of its extent.
    double forced_rate() const;
    /// [N/m3] Of the last assembled Hessian, per area: a rate like it holds every vertex where it is.
    double largest_stiffness() const;
    /// Whether a rate allows steps to speak of; not so numbers beyond all bounds, and zero, which no doubling changes.
    bool is_sensible(double rate) const;
    double length(const VectorXd& p) const;  // [m], of what moves most
    bool lowers(double energy) const { return energy <= energy_ + 1e-12 * std::abs(energy_); }
    /// Pushes q along the mode as far as the energy falls, and at least a little, to the side where it falls deeper; the
    /// energy there.
    double leave_saddle(const Mode& mode);

    Newton& newton_;
    Model& model_;
    VectorXd& q_;
    const Controls& controls_;
    RelaxationReport report_;
    std::string in_the_way_;  // of the last step that an obstacle has not let pass, in words
    double energy_, rate_ = 0.0;
    double last_move_ = std::numeric_limits<double>::infinity();
    const double settled_;  // [m] a step that moves less has come to rest, or to a saddle
};

}  // namespace magshell
