// Friction of bodies that touch each other or themselves.                              contact/pair_friction.h
//
// Exact: with the normal forces, the normals and the closest points at the end of the stage. Lagged: with those at the
// beginning of the step, which leaves a symmetric matrix.                              [Li et al. 2020, IPC]
#pragma once

#include <memory>
#include <vector>

#include "magshell/contact/pair_friction.h"
#include "magshell/term/body_contact_term.h"
#include "magshell/term/force_term.h"

namespace magshell {

class BodyFrictionTerm final : public ForceTerm {
  public:
    /// One flag a contact, as in FrictionTerm.
    BodyFrictionTerm(BodyContactTerm& contact, std::vector<bool> rubs, std::vector<bool> lagged)
        : contact_(contact), rubs_(std::move(rubs)), lagged_(std::move(lagged)) {}

    std::string_view name() const override { return "body friction"; }
    void set_values(const Values&) override {}  // the contact's
    void begin_step(const VectorXd& q, const Controls& controls) override;
    void evaluate(const Kinematics& at, const Controls& controls, Residual& out) override;
    void assemble(const Kinematics& at, const Controls& controls, bool cautious, SystemMatrix& out,
                  NonsymmetricTangent& rest) const override;
    void add_stiffness(const Kinematics& at, std::vector<PairStiffness>& out) const override;
    void vjp(const Kinematics& at, const Controls& controls, const VectorXd& lambda, KinematicsGradient& by,
             Gradient& out) const override;
    void hold(bool held) override;
    void add_cancelling_forces(const Kinematics& at, VectorXd& out) const override;

  private:
    using Touch = BodyContactTerm::Touch;
    struct Rub {
        const Touch* touch;
        bool lagged;
        PairFriction friction;
    };

    BodyContactTerm& contact_;
    std::vector<bool> rubs_, lagged_;
    std::vector<Touch> before_;  // of lagged contacts, when the step began
    std::vector<Touch> held_, now_;
    bool holds_ = false;
    std::vector<Rub> rubbing_;  // at the last evaluated state
};

}  // namespace magshell
