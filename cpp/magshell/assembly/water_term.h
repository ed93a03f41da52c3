// Drag, thrust and added mass of water on all faces.                                      force/drag.h
#pragma once

#include <memory>

#include "magshell/assembly/face_loop.h"
#include "magshell/assembly/force_term.h"
#include "magshell/force/drag.h"

namespace magshell {

class WaterTerm final : public ForceTerm {
  public:
    WaterTerm(const Sheet& sheet, const FaceLoop& faces) : sheet_(sheet), loop_(faces) {}

    void set_water(std::shared_ptr<const Water> water) { water_ = std::move(water); }

    std::string_view name() const override { return "water"; }
    void evaluate(const Kinematics& at, const Controls& controls, Residual& out) override;
    void assemble(const Kinematics& at, const Controls& controls, bool cautious, SystemMatrix& out,
                  Remainder& rest) const override;
    void vjp(const Kinematics& at, const Controls& controls, const VectorXd& lambda, KinematicsGradient& by,
             SceneGradient& out) const override;

  private:
    Drag drag(const Kinematics& at, Index face) const;

    const Sheet& sheet_;
    const FaceLoop& loop_;
    std::shared_ptr<const Water> water_;
};

}  // namespace magshell
