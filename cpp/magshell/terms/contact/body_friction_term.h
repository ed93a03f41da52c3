// BodyFrictionTerm: friction between bodies in contact with each other or with themselves.
// contact/pair_friction.h, terms/contact/friction_contacts.h
#pragma once

#include <utility>
#include <vector>

#include "magshell/contact/pair_friction.h"
#include "magshell/terms/contact/body_contact_term.h"
#include "magshell/terms/contact/friction_contacts.h"
#include "magshell/terms/force_term.h"

namespace magshell {

inline Index index_of_contact(const BodyContactTerm::ActiveContact& active) {
    return active.near.contact;
}

class BodyFrictionTerm final : public ForceTerm {
  public:
    /// Creates friction for a contact term.
    BodyFrictionTerm(BodyContactTerm& contact, FrictionContacts<BodyContactTerm::ActiveContact> contacts)
        : contact_(contact), contacts_(std::move(contacts)) {}

    std::string_view name() const override { return "body friction"; }
    void set_values(const Values&) override {}  // the contact term reads them
    void begin_step(const VectorXd& q, const LoadParameters& load_parameters) override;
    void evaluate(const Kinematics& at, const LoadParameters& load_parameters, Residual& out) override;
    void assemble(const Kinematics& at, const LoadParameters& load_parameters, bool positive_definite,
                  SystemMatrix& out, NonsymmetricTangent& rest) const override;
    void add_stiffness(const Kinematics& at, std::vector<PairStiffness>& out) const override;
    void vjp(const Kinematics& at, const LoadParameters& load_parameters, const VectorXd& lambda,
             KinematicsGradient& by, Gradient& out) const override;
    void add_rest_vjp(const Kinematics& at, const VectorXd& lambda, VectorXd& out) const override;
    void set_frozen(bool frozen) override;
    void add_cancelling_forces(const Kinematics& at, VectorXd& out) const override;

  private:
    using ActiveContact = BodyContactTerm::ActiveContact;
    struct FrictionContact {
        const ActiveContact* active;
        bool lagged;
        double factor;  // of both coefficients of friction
        PairFriction friction;
    };

    BodyContactTerm& contact_;
    FrictionContacts<ActiveContact> contacts_;
    std::vector<FrictionContact> friction_contacts_;  // at the last evaluated state
};

}  // namespace magshell
