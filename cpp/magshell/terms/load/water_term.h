// WaterTerm: drag, thrust, viscous drag and added mass of surrounding water on all faces of a body.
// force/drag.h, force/added_mass.h
#pragma once

#include "magshell/assembly/element_loop.h"
#include "magshell/body/surface.h"
#include "magshell/force/added_mass.h"
#include "magshell/force/drag.h"
#include "magshell/terms/force_term.h"

namespace magshell {

class WaterTerm final : public ForceTerm {
  public:
    /// Creates the term with the drag and thrust curves of `water`; its other numbers are parameters, which all
    /// surfaces share.
    WaterTerm(const Surface& surface, const FaceLoop& faces, const Water& water, Registry& registry);

    std::string_view name() const override { return "water"; }
    void set_values(const Values& values) override;
    void evaluate(const Kinematics& at, const LoadParameters& load_parameters, Residual& out) override;
    void assemble(const Kinematics& at, const LoadParameters& load_parameters, bool positive_definite,
                  SystemMatrix& out, NonsymmetricTangent& rest) const override;
    void vjp(const Kinematics& at, const LoadParameters& load_parameters, const VectorXd& lambda,
             KinematicsGradient& by, Gradient& out) const override;
    void add_cancelling_forces(const Kinematics& at, VectorXd& out) const override;

    bool may_have_fluid_momentum() const override { return true; }
    void add_momentum(const VectorXd& q, const VectorXd& v, VectorXd& out) const override;
    void momentum_vjp(const VectorXd& q, const VectorXd& v, const VectorXd& lambda, VectorXd& by_q,
                      VectorXd& by_v, Gradient& out) const override;
    double fluid_energy(const VectorXd& q, const VectorXd& v, VectorXd* by_q) const override;

  private:
    bool has_added_mass() const { return water_.added_mass > 0.0; }
    MovingFace moving_face(const VectorXd& q, const VectorXd& v, Index face) const;

    const Surface& surface_;
    const FaceLoop& loop_;
    ParameterSlice fluid_density_, velocity_, drag_coefficient_, thrust_coefficient_, added_mass_,
        normal_viscous_drag_, tangential_viscous_drag_;
    Water water_;
};

}  // namespace magshell
