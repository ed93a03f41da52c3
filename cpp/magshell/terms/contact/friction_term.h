// FrictionTerm: friction at the points in contact with an obstacle. force/friction.h
//
// Exact friction uses the normal force and the normal at the end of the stage. Lagged friction uses those at
// the beginning of the step; it then has a potential of the velocities and a symmetric matrix. [Geilinger et
// al. 2020]
#pragma once

#include "magshell/force/friction.h"
#include "magshell/terms/contact/contact_term.h"
#include "magshell/terms/force_term.h"

namespace magshell {

class FrictionTerm final : public ForceTerm {
  public:
    /// Creates friction for a contact term. Both lists have one flag per contact: whether it has friction, and
    /// whether friction is lagged.
    FrictionTerm(const ContactTerm& contact, std::vector<bool> has_friction, std::vector<bool> lagged)
        : contact_(contact), has_friction_(std::move(has_friction)), lagged_(std::move(lagged)) {}

    std::string_view name() const override { return "friction"; }
    void set_values(const Values&) override {}  // the contact term reads them
    void begin_step(const VectorXd& q, const LoadParameters& load_parameters) override;
    void evaluate(const Kinematics& at, const LoadParameters& load_parameters, Residual& out) override;
    void assemble(const Kinematics& at, const LoadParameters& load_parameters, bool positive_definite,
                  SystemMatrix& out, NonsymmetricTangent& rest) const override;
    void vjp(const Kinematics& at, const LoadParameters& load_parameters, const VectorXd& lambda,
             KinematicsGradient& by, Gradient& out) const override;
    /// Freezes normal forces and normals. Friction is then the gradient of a convex potential of the
    /// velocities.
    void set_frozen(bool frozen) override;
    void add_cancelling_forces(const Kinematics& at, VectorXd& out) const override;

  private:
    struct FrictionContact {
        ContactTerm::ActiveContact active;
        bool lagged;
        /// Factor of the coefficient of friction: that of the contact forces where `active` does not have it yet.
        double factor;
        ObstacleState obstacle;
        Friction friction;
    };

    const ContactTerm& contact_;
    std::vector<bool> has_friction_, lagged_;
    std::vector<ContactTerm::ActiveContact> before_;  // lagged contacts at the beginning of the step
    std::vector<ContactTerm::ActiveContact> frozen_contacts_;
    bool frozen_ = false;
    LoadParameters load_parameters_before_;
    std::vector<FrictionContact> friction_contacts_;  // at the last evaluated state
};

}  // namespace magshell
