// Derivatives of forces, strains and prescribed motions of a scene at a fixed state, along one direction of the inputs of a motion and of
// the predictions with which a stage begins. For motion_tangent.h.
#pragma once

#include <map>
#include <memory>
#include <optional>
#include <utility>

#include "magshell/adjoint/directional_derivative.h"
#include "magshell/adjoint/motion_tangent.h"
#include "magshell/scene/changing_forces.h"

namespace magshell {

/// A stage of a step, with the derivatives (tangents) of the quantities with which it begins. Names as in motion_tangent.h.
struct StageTangent {
    const SubstepRecord& record;
    const VectorXd &x_hat, &v_hat, &p_hat;  // predictions of x, v and the carried momentum
    const VectorXd &x_hat_tangent, &v_hat_tangent, &p_hat_tangent;
    const Model::AngleBranches& angle_branches;
    double T, T_tangent;  // [s] a dt, the time of the stage
    double contact_factor;
    LoadParameters load_parameters, tangent;  // in the stage
    LoadParameters begin, begin_tangent;      // at the beginning of the step
    const VectorXd& q_begin_tangent;          // of the state there
};

/// The derivatives of the forces at a fixed state, and of the contact forces among them.
struct ForceTangent {
    VectorXd gradient, contact;
};

/// The derivative of the prescribed motion of a state; parts are empty where there is none.
struct PrescribedTangent {
    VectorXd by_supports;       // motion of all dofs
    VectorXd by_motors;         // motion of all dofs
    VectorXd reduced_residual;  // change of the reduced residual because joints rotate or move
    VectorXd motion() const { return by_motors.size() > 0 ? VectorXd(by_supports + by_motors) : by_supports; }
};

class MotionDerivatives {
  public:
    /// values: of the scene, in the order of the caller. varying: the values that vary in time.
    MotionDerivatives(Model& model, const VectorXd& values, const TimeVaryingParameters& varying,
                      const MotionInputTangent& along);

    bool values_change() const { return values_change_; }
    /// Gives the scene its values, and those that vary in time, at a place along the direction. Returns its model there, which is
    /// another one if the rest shape changes: with the branches of angles, the strain history and the contact factor of this one.
    Model& set(double t, const LoadParameters& load_parameters);
    /// Returns the model at a place along the direction, without setting its values.
    Model& reshaped_at(double t);
    /// Sets the model to the conditions of a stage.
    void set_stage(const StageTangent& stage);
    /// Takes note of the strain histories that were set in the elastic terms and the dampers of the model; nullptr where none was.
    void set_history(const StrainSet* elastic, const StrainSet* dampers) {
        elastic_shift_ = elastic;
        dampers_shift_ = dampers;
    }
    /// Returns a step of differences over which the inputs change little, and so do numbers of these sizes at these rates.
    double step_along(std::initializer_list<std::pair<double, double>> sizes_and_rates) const;

    /// Return the derivatives at a fixed state q: of the gradient of the energy; of the forces of a stage.
    VectorXd energy_gradient(const VectorXd& q, const LoadParameters& load_parameters,
                             const LoadParameters& tangent);
    ForceTangent forces(const StageTangent& stage, const VectorXd& q, bool with_contact);
    /// Returns the derivative of the strains at q, the state evaluated last, along a motion and by the inputs.
    StrainSet strains(ViscousTerms& terms, const VectorXd& q, const VectorXd& motion,
                      const LoadParameters& load_parameters, const LoadParameters& tangent);
    /// Returns the derivative of the momentum that forces carry at q and v; empty if none may.
    VectorXd fluid_momentum(const VectorXd& q, const VectorXd& v, const VectorXd& q_tangent,
                            const VectorXd& v_tangent, const LoadParameters& load_parameters,
                            const LoadParameters& tangent);
    /// Returns the derivative of the strain rates of joint dampers at the beginning of a step, for the tangents of q and v there.
    StrainSet damper_rates(const MotionState& begin, const VectorXd& q_tangent, const VectorXd& v_tangent,
                           const LoadParameters& load_parameters, const LoadParameters& tangent);
    /// Returns the prescribed motion of a state at which the model was evaluated last. gradient: of the stage there.
    PrescribedTangent prescribed(const StageTangent& stage, const VectorXd& q, const VectorXd& gradient);

  private:
    VectorXd values_at(double t);
    void begin_step(Model& model, const StageTangent& stage, double t);
    void find_changing_forces();
    /// Returns the largest force on any dof that cancels in the residual at q; the last result is kept for states that extend no further.
    double cancelling(const VectorXd& q);

    // The model of the scene in another rest shape, while the values vary in time.
    struct Reshaped {
        Model* model;
        std::unique_ptr<ScopedTimeVarying> varying;
    };

    Model& model_;
    const VectorXd& values_;
    const TimeVaryingParameters& varying_;
    const MotionInputTangent& along_;
    const bool reshapes_, values_change_;
    const StrainSet *elastic_shift_ = nullptr, *dampers_shift_ = nullptr;
    std::optional<ChangingForces> changing_;   // all may change without it
    double cancelling_ = 0.0, reach_ = 0.0;    // [N], [m] up to which it holds
    std::map<double, Reshaped> reshaped_;      // by their place along the direction
    VectorXd unit_;                            // of forces on all dofs: moments count over the shortest edge
    std::map<double, VectorXd> known_values_;  // by their place along the direction
    DirectionalDerivative forces_, energy_, strains_, prescribed_, dampers_, momentum_;
};

/// Returns vectors one after another.
VectorXd joined(std::initializer_list<VectorXd> parts);
/// Returns the largest magnitude of the entries; 0 if there are none.
double largest(const VectorXd& of);

}  // namespace magshell
