// The tangent of the viscous part of a step (solve/motion/viscosity.h), stage by stage: its derivative along a direction of the inputs. It
// does nothing without viscosity.
#pragma once

#include "magshell/solve/motion/stepper.h"

namespace magshell {

/// Viscous strains at the end of a step, and their tangents.
class ViscousTangent {
  public:
    /// kind: selects the rates of `terms`. law_tangent: of the same branches.
    ViscousTangent(ViscousTerms& terms, const Viscosity& law, const Viscosity& law_tangent,
                   ViscousStage::Kind kind);

    /// Begins a step at the evaluated state. d_tangent: of its strains. first, first_tangent: rates that the step begins with, or nullptr.
    void begin(const StepAlgebra& step, double dt_tangent, StrainSet d, StrainSet d_tangent,
               const MaxwellStrains& e, const MaxwellStrains& e_tangent, const StageRates* first,
               const StageRates* first_tangent);
    /// Computes the history of stage i, and sets it in the terms.
    void set_history(int i);
    /// Returns the change of the forces at the evaluated state q by the history that was set last.
    VectorXd forces(const VectorXd& q, Index unknowns) const;
    /// Ends the stage whose history was set last, with its strains and their tangent.
    void finish(StrainSet d, const StrainSet& d_tangent);

    /// The history that was set last, or nullptr.
    const StrainSet* shift() const { return acts_ ? &now_.shift : nullptr; }

    bool idle() const { return !acts_; }
    const MaxwellStrains& e_tangent() const { return stage_.e; }
    const StrainRates& rates_tangent() const { return rate_tangents_.back().*kind_; }

  private:
    double ratio_tangent(std::size_t k) const;
    double relaxed_tangent(std::size_t k) const;
    double stage_time_tangent() const { return step_->tableau().diagonal * dt_tangent_; }

    ViscousTerms& terms_;
    const Viscosity &law_, &law_tangent_;
    const ViscousStage::Kind kind_;
    const bool acts_;
    const StepAlgebra* step_ = nullptr;
    double dt_tangent_ = 0.0, scale_tangent_ = 0.0;
    StrainSet d_begin_, d_begin_tangent_;
    MaxwellStrains e_begin_, e_begin_tangent_;
    std::vector<StageRates> rates_, rate_tangents_;
    ViscousStage now_, stage_;  // the present stage, and its tangent
};

}  // namespace magshell
