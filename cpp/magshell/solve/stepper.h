// One time step, as a few implicit stages: each is a static solve with the inertia as a quadratic pull,
//
//   W (x_i - z_i) + g(x_i) = 0,   W = M/(a dt)^2 + Gamma/(a dt),   W z_i = M (x^_i + a dt v^_i)/(a dt)^2
//                                                                          + Gamma x^_i/(a dt)
//
// x^_i and v^_i are what the stages before it and the start of the step contribute.       [Chen22] (26)-(28)
#pragma once

#include <span>

#include "magshell/solve/newton.h"
#include "magshell/solve/projective.h"
#include "magshell/solve/tableau.h"
#include "magshell/solve/viscosity.h"

namespace magshell {

/// Where a sheet is and how fast it moves; v and w are zero for unknowns that are no vertex.
struct MotionState {
    VectorXd q, v;
    Model::Turns turns;
    StrainSet e;       // of the Maxwell branch; empty without one
    StageRates rates;  // at the end of the step that led here, for a method that begins with them; else empty
    VectorXd driving;  // what motors do there [N, N m]; empty where none is, and before the first step
    VectorXd held =
        {};  // [N] what supports pulled with at the end of that step, as Reduction::held; else empty
    VectorXd v_before = {};  // where motors are: at the beginning of the step that led here
    double dt_before = 0.0;  // [s] of that step; 0: there was none
};

/// Of all unknowns: masses [kg] and viscous damping [N s/m], zero for those that are no vertex.
struct Inertia {
    VectorXd mass, damping;
};

/// One stage once it is solved.
struct StageState {
    VectorXd q;
    Model::Turns turns;
    std::shared_ptr<const Factor> factor;  // of Newton's last step, if it was to be kept
};

/// A step, or a part of one: all that its adjoint needs.
struct SubstepRecord {
    MotionState begin;
    std::vector<StageState> stages;
};

/// The linear algebra around a stage, the same forwards and backwards.
class StepAlgebra {
  public:
    StepAlgebra(const Tableau& tableau, const Inertia& inertia, double dt);

    /// What stage i starts from, given all rates until then.
    void start_of_stage(int i, const MotionState& begin, const std::vector<StageRates>& rates,
                        VectorXd& x_hat, VectorXd& v_hat) const;
    /// v and w of a stage, from where it ended.
    void finish_stage(const VectorXd& q, const VectorXd& x_hat, const VectorXd& v_hat, Index coordinates,
                      StageRates& rates) const;
    VectorXd target(const VectorXd& x_hat, const VectorXd& v_hat) const;
    const VectorXd& weights() const { return weights_; }
    /// a dt [s]
    double stage_time() const { return stage_time_; }
    double dt() const { return dt_; }
    const Tableau& tableau() const { return tableau_; }

  private:
    Tableau tableau_;
    double dt_, stage_time_;
    VectorXd weights_, velocity_share_;
};

class Stepper {
  public:
    Stepper(Newton& newton, const Tableau& tableau, Inertia inertia, const Viscosity& viscosity,
            const ProjectiveOptions& projective);

    /// Takes the state over a step with these controls at its beginning and at its stages, as tableau_from() says. On
    /// failure the state stays, and the reason tells why. `kept`, if given, gets the step; with_factors: Newton's last
    /// factorizations too.
    bool step(MotionState& state, double dt, bool dissipative, std::span<const Controls> controls,
              SubstepRecord* kept, bool with_factors, std::string& reason);

    /// The method of a step from this state: SDIRK2 where there are no rates to begin with; dissipative: implicit Euler.
    const Tableau& tableau_from(const MotionState& state, bool dissipative) const;
    const StepAlgebra& algebra(double dt, const Tableau& tableau);

  private:
    /// A stage, by other means where the first fail.
    NewtonReport solve(VectorXd& q, const Controls& controls, const Anchor& anchor);

    Newton& newton_;
    std::unique_ptr<ProjectiveSolver> projective_;  // nullptr: Newton's steps
    Tableau tableau_, starter_ = sdirk2(), dissipative_ = implicit_euler();
    Inertia inertia_;
    Viscosity viscosity_;
    std::unique_ptr<StepAlgebra> algebra_;  // of the last step
};

/// The rates that a step begins with: those of the state, if the method takes them.
std::vector<StageRates> first_rates(const Model& model, const Tableau& tableau, const MotionState& state);

/// The rates of a step that was taken, from its states: those it began with, and those of its stages.
struct StepRates {
    std::vector<VectorXd> x_hat, v_hat;
    std::vector<StageRates> all;

    StepRates(const Model& model, const StepAlgebra& step, const SubstepRecord& substep);
};

}  // namespace magshell
