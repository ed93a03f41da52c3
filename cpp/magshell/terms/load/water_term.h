// WaterTerm: drag, thrust and added mass of surrounding water on all faces of a shell.
// force/drag.h
#pragma once

#include "magshell/assembly/element_loop.h"
#include "magshell/body/surface.h"
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

  private:
    Drag drag(const Kinematics& at, Index face) const;

    const Surface& surface_;
    const FaceLoop& loop_;
    ParameterSlice fluid_density_, velocity_, drag_coefficient_, thrust_coefficient_, added_mass_;
    Water water_;
};

}  // namespace magshell
