// One time step, as a few implicit stages. Each stage is a static solve with the inertia as a proximal term,
//
//   W (x_i - z_i) + g(x_i) = 0,   W = M/(a dt)^2 + Gamma/(a dt),   W z_i = M (x^_i + a dt v^_i)/(a dt)^2
//                                                                          + Gamma x^_i/(a dt)
//
// where x^_i and v^_i are the contributions of the start of the step and of the stages before it.       [Chen22] (26)-(28)
// Momentum p(x, v) that forces carry beside M v, as water does, goes the same way (ForceTerm):
//
//   p^_i = p + dt sum_j a_ij r_j,   r_i = (p(x_i, v_i) - p^_i)/(a dt),   M w_i + r_i + g(x_i) = 0
#pragma once

#include <span>

#include "magshell/solve/motion/free_flight.h"
#include "magshell/solve/motion/tableau.h"
#include "magshell/solve/motion/viscosity.h"
#include "magshell/solve/newton/newton.h"
#include "magshell/solve/projective/projective.h"

namespace magshell {

/// The state of a motion; v and the rates are zero for dofs that are not of a vertex.
struct MotionState {
    VectorXd q, v;
    Model::AngleBranches angle_branches;
    MaxwellStrains e;       // empty without a Maxwell branch
    StageRates rates;       // at the end of the step that led here, for a method that needs them; else empty
    VectorXd motor_forces;  // of the motors [N, N m]; empty without motors and before the first step
    VectorXd held =
        {};  // [N] of the supports at the end of that step, as DofMap::along_supports orders them; else empty
    VectorXd v_before = {};  // with motors: the velocity at the beginning of the step that led here
    double dt_before = 0.0;  // [s] of that step; 0: there was none
};

/// Masses [kg] and viscous damping [N s/m] of all dofs, zero for those that are not of a vertex.
struct Inertia {
    VectorXd mass, damping;
};

/// The solution of one stage.
struct StageState {
    VectorXd q;
    Model::AngleBranches angle_branches;
    std::shared_ptr<const Factor> factor;  // of the last Newton iteration, if it was to be stored
    VectorXd contact = {};                 // StageRates::c
};

/// A step or substep, with all that its adjoint needs.
struct SubstepRecord {
    MotionState begin;
    std::vector<StageState> stages;
};

/// The linear algebra of a stage, which the step and its adjoint share.
class StepAlgebra {
  public:
    StepAlgebra(const Tableau& tableau, const Inertia& inertia, double dt);

    /// Computes x^ and v^ of stage i from all rates before it.
    void start_of_stage(int i, const MotionState& begin, const std::vector<StageRates>& rates,
                        VectorXd& x_hat, VectorXd& v_hat) const;
    /// Returns p^ of stage i from the carried momentum at the beginning of the step; empty if that is.
    VectorXd start_of_momentum(int i, const VectorXd& momentum, const std::vector<StageRates>& rates) const;
    /// Computes v and w of stage i from its solution and rates.c.
    void finish_stage(int i, const VectorXd& q, const VectorXd& x_hat, const VectorXd& v_hat,
                      Index coordinates, StageRates& rates) const;
    /// Returns w_i of a stage with its contact forces: (v_i - v^_i)/(a dt).
    VectorXd stage_acceleration(const StageRates& rates, const VectorXd& v_hat) const {
        return (rates.v - v_hat) / stage_time_;
    }
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

/// RAII guard that gives contact forces their usual factor, 1, again at the end of its scope.
class ScopedContactFactor {
  public:
    explicit ScopedContactFactor(const Model& model) : model_(model) {}
    ScopedContactFactor(const ScopedContactFactor&) = delete;
    ScopedContactFactor& operator=(const ScopedContactFactor&) = delete;
    ~ScopedContactFactor() { model_.contacts().set_factor(1.0); }

  private:
    const Model& model_;
};

class Stepper {
  public:
    Stepper(Newton& newton, const Tableau& tableau, Inertia inertia, const Viscosity& viscosity,
            const ProjectiveOptions& projective);

    /// Advances the state by a step, with the load parameters at its beginning and at the stages of tableau_from(). On failure the state
    /// is unchanged, and `reason` says why. `kept` receives the step if it is not null, and with_factors the last factorization
    /// of each stage, which stages may share.
    bool step(MotionState& state, double dt, bool dissipative,
              std::span<const LoadParameters> load_parameters, SubstepRecord* kept, bool with_factors,
              std::string& reason);

    /// Returns the method of a step from this state: SDIRK2 if it needs rates that the state lacks; implicit Euler if dissipative. Contact
    /// is implicit in all three or in none.
    const Tableau& tableau_from(const MotionState& state, bool dissipative) const;
    const StepAlgebra& algebra(double dt, const Tableau& tableau);
    /// Returns the rigid bodies whose free flight is known (free_flight.h).
    const std::vector<FreeBody>& free_bodies() const { return free_bodies_; }
    /// Returns the estimated error of the step taken last [m] (step_error.h).
    double error() const { return error_; }

  private:
    /// Solves a stage of a step from q, the prediction; by standard Newton steps or a descent if the usual steps fail.
    /// begin: the beginning of the step. factor: of a factorization with which the iteration may begin; or null.
    NewtonReport solve(VectorXd& q, const MotionState& begin, const LoadParameters& load_parameters,
                       const ProximalTerm& proximal, const FactorReport* factor);
    /// Returns true if the last factorization may serve a stage predicted at q. last: report of the stage before, which took so many
    /// factorizations and ended in contact or not.
    bool serves_again(const NewtonReport& last, int factorizations, bool in_contact, const VectorXd& q,
                      const LoadParameters& load_parameters) const;

    Newton& newton_;
    std::unique_ptr<ProjectiveSolver> projective_;  // nullptr: stages are solved by Newton
    Tableau tableau_, starter_ = sdirk2(), dissipative_ = implicit_euler();
    Inertia inertia_;
    std::vector<FreeBody> free_bodies_;
    Viscosity viscosity_;
    std::unique_ptr<StepAlgebra> algebra_;  // of the last step
    double error_ = 0.0;                    // [m]
};

/// Returns the rates with which a step begins: those of the state, if the method uses them; else none.
std::vector<StageRates> first_rates(const Model& model, const Tableau& tableau, const MotionState& state);

/// The rates of a step, recomputed from its stored states: those it began with, and those of its stages.
struct StepRates {
    FreeFlight flight;
    std::vector<VectorXd> x_hat, v_hat, p_hat;
    std::vector<StageRates> all;

    /// load_parameters: those at the beginning of the step, which the model has again afterwards, and at its stages.
    StepRates(Model& model, const StepAlgebra& step, const std::vector<FreeBody>& free_bodies,
              const SubstepRecord& substep, std::span<const LoadParameters> load_parameters);
};

}  // namespace magshell
