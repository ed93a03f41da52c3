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
    FrictionTerm(const ContactTerm& contact, std::vector<bool> rubs, std::vector<bool> lagged)
        : contact_(contact), rubs_(std::move(rubs)), lagged_(std::move(lagged)) {}

    std::string_view name() const override { return "friction"; }
    void set_values(const Values&) override {}  // the contact's
    void begin_step(const VectorXd& q, const Controls& controls) override;
    void evaluate(const Kinematics& at, const Controls& controls, Residual& out) override;
    void assemble(const Kinematics& at, const Controls& controls, bool cautious, SystemMatrix& out,
                  NonsymmetricTangent& rest) const override;
    void vjp(const Kinematics& at, const Controls& controls, const VectorXd& lambda, KinematicsGradient& by,
             Gradient& out) const override;
    /// Normal forces and normals: with held ones, friction is the slope of a convex potential of the velocities.
    void hold(bool held) override;
    void add_cancelling_forces(const Kinematics& at, VectorXd& out) const override;

  private:
    struct Rub {
        ContactTerm::Touch touch;
        bool lagged;
        StandingObstacle obstacle;
        Friction friction;
    };

    const ContactTerm& contact_;
    std::vector<bool> rubs_, lagged_;
    std::vector<ContactTerm::Touch> before_;  // of lagged contacts, when the step began
    std::vector<ContactTerm::Touch> held_;
    bool holds_ = false;
    Controls controls_before_;
    std::vector<Rub> rubbing_;  // at the last evaluated state
};

}  // namespace magshell
