// Base class of the two energy descents: the state, the rate 1/dt that limits the steps, and the escape from a saddle.
#pragma once

#include <limits>
#include <string>

#include "magshell/solve/globalization/pseudo_transient.h"
#include "magshell/solve/modes.h"

namespace magshell {

class EnergyDescent {
  protected:
    /// Moves supports to their targets at these load parameters; the report says if that is impossible.
    EnergyDescent(Newton& newton, VectorXd& q, const LoadParameters& load_parameters);

    /// Alternates assess() and advance() until one of them returns false: assess() if the report is final, advance() if no step is left.
    template <class Assess, class Advance>
    RelaxationReport run_loop(int max_steps, Assess&& assess, Advance&& advance) {
        if (!report_.reason.empty()) return report_;
        for (; report_.steps < max_steps; ++report_.steps) {
            if (!assess()) return report_;
            if (advance()) continue;
            report_.reason = "no step lowers the energy, however short";
            if (!crossing_reason_.empty()) report_.reason += "; " + crossing_reason_;
            return report_;
        }
        report_.reason = "no equilibrium after " + std::to_string(max_steps) + " relaxation steps";
        return report_;
    }

    /// Returns true if the descent can continue although the Hessian could not be factorized, for example because a body is free to
    /// rotate; sets a rate from the forces. Reports a neutral equilibrium if the state is stationary.
    bool continue_without_factor(const FactorReport& factor, bool at_rest);

    /// Finishes by a Newton solve: returns true if solve(trial) converges from q to a state for which good(report, trial) holds, and moves q there.
    template <class Solve, class Good>
    bool finish_with_newton(Solve&& solve, Good&& good) {
        VectorXd trial = q_;
        const Model::AngleBranches angle_branches = model_.angle_branches();
        const NewtonReport report = solve(trial);
        if (!report.converged || !good(report, trial) || crosses_obstacle(trial)) {
            model_.set_angle_branches(angle_branches);
            return false;
        }
        report_.residual = report.residual;
        q_ = trial;
        return true;
    }

    /// Returns true if a point would pass through an obstacle on the straight way from q to `trial`.
    bool crosses_obstacle(const VectorXd& trial);
    /// Returns the rate [N/m3] at which the forces move a body held by the proximal term alone by a twentieth of its extent.
    double forced_rate() const;
    /// Returns the largest diagonal entry of the last assembled Hessian per area [N/m3]; this rate holds every vertex in place.
    double largest_stiffness() const;
    /// Returns true if a rate allows steps of a useful length: it is positive, finite and not too large.
    bool is_sensible(double rate) const;
    double length(const VectorXd& p) const;  // [m], largest displacement
    bool lowers(double energy) const { return energy <= energy_ + energy_tolerance * std::abs(energy_); }
    /// Displaces q along the mode as far as the energy falls, at least by a small amount, on the side where it falls deeper. Returns the
    /// energy there.
    double leave_saddle(const Mode& mode);

    // [-] Increase of the energy that counts as none, over its size; see test_small_load_on_a_shallow_roof.
    static constexpr double energy_tolerance = 1e-12;

    Newton& newton_;
    Model& model_;
    VectorXd& q_;
    const LoadParameters& load_parameters_;
    RelaxationReport report_;
    std::string crossing_reason_;  // why an obstacle refused the last step, in words; empty if none did
    double energy_, rate_ = 0.0;
    double last_displacement_ = std::numeric_limits<double>::infinity();
    const double settled_;  // [m] a step shorter than this has reached an equilibrium or a saddle
};

}  // namespace magshell
