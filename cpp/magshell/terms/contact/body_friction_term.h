// BodyFrictionTerm: friction between bodies in contact with each other or with themselves.
// contact/pair_friction.h
//
// Exact friction uses the normal forces, normals and closest points at the end of the stage. Lagged friction
// uses those at the beginning of the step, which leaves a symmetric matrix. [Li et al. 2020, IPC]
#pragma once

#include <memory>
#include <vector>

#include "magshell/contact/pair_friction.h"
#include "magshell/terms/contact/body_contact_term.h"
#include "magshell/terms/force_term.h"

namespace magshell {

class BodyFrictionTerm final : public ForceTerm {
  public:
    /// Creates friction for a contact term. Both lists have one flag per contact, as in FrictionTerm.
    BodyFrictionTerm(BodyContactTerm& contact, std::vector<bool> has_friction, std::vector<bool> lagged)
        : contact_(contact), has_friction_(std::move(has_friction)), lagged_(std::move(lagged)) {}

    std::string_view name() const override { return "body friction"; }
    void set_values(const Values&) override {}  // the contact term reads them
    void begin_step(const VectorXd& q, const LoadParameters& load_parameters) override;
    void evaluate(const Kinematics& at, const LoadParameters& load_parameters, Residual& out) override;
    void assemble(const Kinematics& at, const LoadParameters& load_parameters, bool positive_definite,
                  SystemMatrix& out, NonsymmetricTangent& rest) const override;
    void add_stiffness(const Kinematics& at, std::vector<PairStiffness>& out) const override;
    void vjp(const Kinematics& at, const LoadParameters& load_parameters, const VectorXd& lambda,
             KinematicsGradient& by, Gradient& out) const override;
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
    std::vector<bool> has_friction_, lagged_;
    std::vector<ActiveContact> before_;  // lagged contacts at the beginning of the step
    std::vector<ActiveContact> frozen_contacts_, now_;
    bool frozen_ = false;
    std::vector<FrictionContact> friction_contacts_;  // at the last evaluated state
};

}  // namespace magshell
