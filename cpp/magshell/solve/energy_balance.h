// Whether a step in which bodies touched has gained energy that nobody put in.
//
// Methods of higher order than implicit Euler gain some in an impact that their steps do not resolve: forces that have
// long ceased, or only begin, act over most of the step. What is put in, by all that has no energy of its own, is what
// the method itself lets it do,
//
//   W = dt sum_j b_j v_j . (M w_j + dE/dx_j)  +  what changing controls do to the energy
//
// which supports, friction, water and viscosity share. Loads that follow a body put in what cannot be told from a gain.
#pragma once

#include <span>

#include "magshell/solve/stepper.h"

namespace magshell {

class EnergyBalance {
  public:
    EnergyBalance(Model& model, const Inertia& inertia) : model_(model), mass_(inertia.mass) {}

    /// Whether there is anything to watch: bodies that touch, and no load without an energy.
    bool watches() const { return model_.has_body_contact() && !model_.follows(); }
    /// Of a step to `end`, with the controls at its beginning and at its stages. Leaves the model as evaluated elsewhere.
    bool gains(const StepAlgebra& step, const SubstepRecord& record, const MotionState& end,
               std::span<const Controls> controls);

  private:
    double kinetic(const MotionState& state) const { return 0.5 * state.v.dot(mass_.cwiseProduct(state.v)); }
    double energy(const VectorXd& q, const Model::Turns& turns, const Controls& controls);
    /// What there is at one end of a step, but its motion.
    struct Standing {
        VectorXd q;
        Model::Turns turns;
        Controls controls;
        double energy, of_contact;  // [J] of all terms, of bodies that touch
    };
    Standing standing(const MotionState& state, const Controls& controls);
    bool touches(const StepAlgebra& step, const SubstepRecord& record) const;
    /// What forces without an energy do over the step, and supports [J].
    double work(const StepAlgebra& step, const SubstepRecord& record, std::span<const Controls> controls);

    Model& model_;
    const VectorXd& mass_;
    Standing end_;  // of the last step
};

}  // namespace magshell
