// The viscous part of a step's adjoint, stage by stage; does nothing in an elastic sheet.
#pragma once

#include "magshell/solve/stepper.h"

namespace magshell {

/// By the Maxwell strains between two steps, and by the rates of the strains there; empty where nothing asks.
struct ViscousGradient {
    StrainSet e, d_rate, e_rate;
};

class ViscousAdjoint {
  public:
    /// Finds the strains of the stages again. kind: of the rates, those of `terms`. by_end: what later steps say of the
    /// end of this one. controls: at the beginning of the step and at its stages.
    ViscousAdjoint(Model& model, ViscousTerms& terms, const Viscosity& law, ViscousStage::Kind kind,
                   const StepAlgebra& step, const SubstepRecord& substep, std::span<const Controls> controls,
                   const ViscousGradient& by_end);

    /// The stresses of stage i have their history from now on.
    void set_history(int i) const;
    /// At the evaluated stage: adds to by_q, and to the values of `scene`, what later rates say of its strains.
    void before_solve(int i, VectorXd& by_q, Gradient& scene);
    /// At the evaluated stage: what lambda says of the history and of the law. Before it, what it says at a state
    /// beside that of stage i, which feels the same history.
    void after_solve(int i, const VectorXd& lambda);
    void beside(int i, const VectorXd& q, const VectorXd& lambda);

    StrainSet by_d_begin;
    ViscousGradient by_begin;
    Viscosity by_law{0.0, 0.0, 0.0};
    double by_dt = 0.0;

  private:
    void take_in(int i, const StrainSet& d, const VectorXd& lambda);
    void pass_on(int i);

    const StrainRates& rates(std::size_t j) const { return rates_[j].*kind_; }
    bool idle() const { return stages_.empty(); }

    ViscousTerms& terms_;
    const Index unknowns_;
    const Viscosity& law_;
    const ViscousStage::Kind kind_;
    const StepAlgebra& step_;
    std::size_t first_ = 0;  // stage among all rates
    std::vector<ViscousStage> stages_;
    std::vector<StageRates> rates_;
    std::vector<StrainSet> by_e_, by_d_hat_, by_e_hat_;  // by stage
    std::vector<StrainSet> by_d_rate_, by_e_rate_;       // by rate
    std::vector<double> by_ratio_, by_stage_time_;
};

}  // namespace magshell
