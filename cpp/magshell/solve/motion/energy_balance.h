// Detects whether a step with contact has gained energy that no force put in.
//
// Methods of higher order than implicit Euler can gain energy in an impact that the time step does not resolve, since contact forces
// that have ended or only begun act over most of the step. The energy that forces without potential and supports put in is
// evaluated with the quadrature of the method itself:
//
//   W = dt sum_j b_j v_j . (M w_j + dE/dx_j)  +  change of the energy with the load parameters
//
// with the weights b_j of the last stage, and velocities v_j and accelerations w_j of the stages (StageRates). M w_j +
// dE/dx_j is the force that is not the gradient of the energy: of supports, friction, drag and viscosity. Carried momentum p of
// water is added to M v: its rate minus dT/dx to M w, and v . p - T to the kinetic energy (ForceTerm). Where contact is
// implicit (tableau.h), w and E of the sum are without contact, and dt (v_begin + v_end)/2 . (M C + dE_C/dx) is added: the
// acceleration C by contact and friction acts at the mean velocity, E_C is the energy of contact. With follower loads the
// test does not apply: it could not distinguish their work from a gain.
//
// Implicit Euler gains energy from obstacles and smooth shapes only where the energy of contact is not convex, as that of two balls that
// meet obliquely. With the contact forces f at the end of the step, contact itself then does more work than it stores less:
//
//   G = E_C(x_end) - E_C(x_begin) + f . (x_end - x_begin) > 0
//
// with both energies for the obstacles at the end of the step, since obstacles that move do work.
#pragma once

#include <span>

#include "magshell/solve/motion/stepper.h"

namespace magshell {

class EnergyBalance {
  public:
    /// All arguments but the tableau must outlive it.
    EnergyBalance(Model& model, const Inertia& inertia, const std::vector<FreeBody>& free_bodies,
                  const Tableau& tableau)
        : model_(model), mass_(inertia.mass), free_bodies_(free_bodies), euler_(tableau.stages == 1) {}

    /// Returns true if the test applies: there is contact, and no load without potential.
    bool applies() const { return model_.contacts().any() && !prevented(); }
    /// Returns true if there is contact, but loads without potential prevent the test.
    bool fails_to_apply() const { return model_.contacts().any() && prevented(); }
    /// Returns true if a step to `end` gained energy; load_parameters: load parameters at its beginning and at its stages. Leaves the model
    /// evaluated at another state.
    bool gains_energy(const StepAlgebra& step, const SubstepRecord& record, const MotionState& end,
                      std::span<const LoadParameters> load_parameters);

  private:
    bool prevented() const { return model_.capabilities().has_unsymmetric_tangent; }
    double kinetic(const MotionState& state, const LoadParameters& load_parameters);
    double energy(const VectorXd& q, const Model::AngleBranches& angle_branches,
                  const LoadParameters& load_parameters);
    /// A state with its load parameters and its potential energies.
    struct StateEnergy {
        VectorXd q;
        Model::AngleBranches angle_branches;
        LoadParameters load_parameters;
        double energy, of_contact;  // [J] of all terms, and of contact
    };
    StateEnergy state_energy(const MotionState& state, const LoadParameters& load_parameters);
    bool has_contact(const StepAlgebra& step, const SubstepRecord& record,
                     std::span<const LoadParameters> load_parameters) const;
    /// Returns G of a step of implicit Euler to `end`, whose forces were evaluated last [J].
    double gain_by_contact(const StateEnergy& begin, const MotionState& end,
                           const LoadParameters& load_parameters) const;
    /// Returns the work of supports and of forces without potential over the step [J].
    double work(const StepAlgebra& step, const SubstepRecord& record,
                std::span<const LoadParameters> load_parameters);

    Model& model_;
    const VectorXd& mass_;
    const std::vector<FreeBody>& free_bodies_;
    const bool euler_;
    StateEnergy end_;  // of the last step
};

}  // namespace magshell
