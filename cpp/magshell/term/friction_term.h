// Friction at the points that touch an obstacle.                                        force/friction.h
//
// Exact: with the normal force and the normal at the end of the stage. Lagged: with those at the beginning of
// the step, which leaves a symmetric matrix, as for a potential of the velocities.           [Geilinger et
// al. 2020]
#pragma once

#include "magshell/force/friction.h"
#include "magshell/term/contact_term.h"
#include "magshell/term/force_term.h"

namespace magshell {

class FrictionTerm final : public ForceTerm {
  public:
    /// One flag a contact: whether it rubs, and whether it does so with the normal force of before.
    FrictionTerm(const ContactTerm& contact, std::vector<bool> has_friction, std::vector<bool> lagged)
        : contact_(contact), has_friction_(std::move(has_friction)), lagged_(std::move(lagged)) {}

    std::string_view name() const override { return "friction"; }
    void set_values(const Values&) override {}  // the contact's
    void begin_step(const VectorXd& q, const Controls& controls) override;
    void evaluate(const Kinematics& at, const Controls& controls, Residual& out) override;
    void assemble(const Kinematics& at, const Controls& controls, bool convexified, SystemMatrix& out,
                  Remainder& rest) const override;
    void vjp(const Kinematics& at, const Controls& controls, const VectorXd& lambda, KinematicsGradient& by,
             Gradient& out) const override;
    /// Normal forces and normals: with held ones, friction is the slope of a convex potential of the velocities.
    void set_frozen(bool frozen) override;
    void add_cancelling_forces(const Kinematics& at, VectorXd& out) const override;

  private:
    struct FrictionContact {
        ContactTerm::ActiveContact active;
        bool lagged;
        ObstacleState obstacle;
        Friction friction;
    };

    const ContactTerm& contact_;
    std::vector<bool> has_friction_, lagged_;
    std::vector<ContactTerm::ActiveContact> before_;  // of lagged contacts, when the step began
    std::vector<ContactTerm::ActiveContact> frozen_contacts_;
    bool frozen_ = false;
    Controls controls_before_;
    std::vector<FrictionContact> friction_contacts_;  // at the last evaluated state
};

}  // namespace magshell
