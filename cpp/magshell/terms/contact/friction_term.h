// FrictionTerm: friction at the points in contact with an obstacle. force/friction.h, terms/contact/friction_contacts.h
#pragma once

#include "magshell/force/friction.h"
#include "magshell/terms/contact/contact_term.h"
#include "magshell/terms/contact/friction_contacts.h"
#include "magshell/terms/force_term.h"

namespace magshell {

inline Index index_of_contact(const ContactTerm::ActiveContact& active) {
    return active.contact;
}

class FrictionTerm final : public ForceTerm {
  public:
    /// Creates friction for a contact term.
    FrictionTerm(const ContactTerm& contact, FrictionContacts<ContactTerm::ActiveContact> contacts)
        : contact_(contact), contacts_(std::move(contacts)) {}

    std::string_view name() const override { return "friction"; }
    void set_values(const Values&) override {}  // the contact term reads them
    void begin_step(const VectorXd& q, const LoadParameters& load_parameters) override;
    void evaluate(const Kinematics& at, const LoadParameters& load_parameters, Residual& out) override;
    void assemble(const Kinematics& at, const LoadParameters& load_parameters, bool positive_definite,
                  SystemMatrix& out, NonsymmetricTangent& rest) const override;
    void vjp(const Kinematics& at, const LoadParameters& load_parameters, const VectorXd& lambda,
             KinematicsGradient& by, Gradient& out) const override;
    void set_frozen(bool frozen) override { contacts_.set_frozen(frozen, contact_.evaluated_contacts()); }
    void add_cancelling_forces(const Kinematics& at, VectorXd& out) const override;

  private:
    struct FrictionContact {
        const ContactTerm::ActiveContact* active;
        std::shared_ptr<const ContactTerm::ActiveContact> surface;  // of a shape, else nullptr
        bool lagged;
        double factor;  // of the coefficient of friction
        ObstacleState obstacle;
        Friction friction;

        /// Returns the contact at whose point friction acts.
        const ContactTerm::ActiveContact& point() const { return surface ? *surface : *active; }
    };

    /// The derivative of the friction of a point by the positions of its nodes and of the rigid body that carries the obstacle: the block
    /// (i, j) at attached_nodes * i + j.
    using AttachedBlocks = std::vector<Mat3>;
    /// v: velocities of all degrees of freedom.
    AttachedBlocks attached_blocks(const FrictionContact& each, const VectorXd& v) const;
    /// Adds a factor times these blocks to a tangent.
    void add_attached(const FrictionContact& each, const AttachedBlocks& blocks, double factor,
                      NonsymmetricTangent& rest) const;
    /// Adds a factor times the gradient of lambda . friction by the positions at the beginning of the step, of lagged friction.
    void add_by_begin(const FrictionContact& each, double factor, const VectorXd& v, const VectorXd& lambda,
                      VectorXd& out) const;

    const ContactTerm& contact_;
    FrictionContacts<ContactTerm::ActiveContact> contacts_;
    LoadParameters load_parameters_before_;
    std::vector<FrictionContact> friction_contacts_;  // at the last evaluated state
};

}  // namespace magshell
