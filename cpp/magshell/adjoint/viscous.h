// The adjoint of the viscous part of a step, stage by stage; it does nothing without viscosity.
#pragma once

#include "magshell/solve/motion/stepper.h"

namespace magshell {

/// The gradient with respect to the Maxwell strains between two steps, and to the rates of the strains there; empty if nothing depends on
/// them.
struct ViscousGradient {
    StrainSet d_rate;
    MaxwellStrains e, e_rate;
};

class ViscousAdjoint {
  public:
    /// Recomputes the strains of the stages. kind: selects the rates of `terms`. by_end: gradient with respect to the end of the step, from
    /// later steps. load_parameters: load parameters at the beginning of the step and at its stages.
    ViscousAdjoint(Model& model, ViscousTerms& terms, const Viscosity& law, ViscousStage::Kind kind,
                   const StepAlgebra& step, const SubstepRecord& substep,
                   std::span<const LoadParameters> load_parameters, const ViscousGradient& by_end);

    /// Sets the strain history of stage i in the terms.
    void set_history(int i) const;
    /// Adds to by_q, and to the parameters of `scene`, the gradients with respect to the strains of the evaluated stage i through later
    /// rates, and returns the gradient with respect to these strains; it is empty without viscosity.
    StrainSet before_solve(int i, VectorXd& by_q, Gradient& scene);
    /// Adds the contribution of lambda at the evaluated stage i to the gradients with respect to the history and to the law.
    void after_solve(int i, const VectorXd& lambda);
    /// Adds the same for a nearby state with the history of stage i; it must be called before after_solve(i).
    void at_nearby_state(int i, const VectorXd& q, const VectorXd& lambda);

    StrainSet by_d_begin;
    ViscousGradient by_begin;
    Viscosity by_law;  // of the same branches
    double by_dt = 0.0;

  private:
    void add_stress_gradient(int i, const StrainSet& d, const VectorXd& lambda);
    void pass_on(int i);

    const StrainRates& rates(std::size_t j) const { return rates_[j].*kind_; }
    bool idle() const { return stages_.empty(); }

    ViscousTerms& terms_;
    const Index unknowns_;
    const Viscosity& law_;
    const ViscousStage::Kind kind_;
    const StepAlgebra& step_;
    std::size_t first_ = 0;  // index of the first stage among all rates
    std::vector<ViscousStage> stages_;
    std::vector<StageRates> rates_;
    std::vector<StrainSet> by_d_hat_, by_d_rate_;              // by stage; by rate
    std::vector<MaxwellStrains> by_e_, by_e_hat_, by_e_rate_;  // by stage, stage and rate
    std::vector<std::vector<double>> by_ratio_;                // by stage and branch
    std::vector<double> by_stage_time_;
};

}  // namespace magshell
