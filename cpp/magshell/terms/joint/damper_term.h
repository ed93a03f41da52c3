// DamperTerm: viscous dampers in joints. They apply a torque against the rate of the joint coordinate; in a
// ball joint, against the relative angular velocity of the links.
//
// A damper is a DampedTerm without elastic energy. Its strains are the joint coordinates; a ball joint has nine
// strains instead (JointKind::damped).
#pragma once

#include <string>
#include <vector>

#include "magshell/terms/damped_term.h"
#include "magshell/terms/joint/joint_form.h"

namespace magshell {

class DamperTerm final : public DampedTerm {
  public:
    struct Input {
        std::string owner;
        Joint joint;
        const Index* parent;  // four corners; nullptr for the world
        const Index* child;
    };

    DamperTerm(const std::vector<Input>& joints, const std::vector<Vec3>& rest, const SystemMatrix& matrix,
               Registry& registry);

    std::string_view name() const override { return "joints"; }
    Capabilities capabilities() const override { return {.has_own_viscosity = true}; }
    bool set_values(const Values& values) override;
    /// Dampers act on few coordinates, whose stiffness in a step L-BFGS learns.
    bool add_projective_stiffness(NodeMatrix&) const override { return true; }
    double energy(const double*, const LoadParameters&) const override { return 0.0; }
    void evaluate(const double* q, const LoadParameters& load_parameters, Residual& out) override;
    void finish_assembly(const double* q, const LoadParameters& load_parameters,
                         SystemMatrix& out) const override;
    void vjp(const double* q, const LoadParameters& load_parameters, const double* lambda,
             Gradient& out) override;
    std::vector<double> angle_branches() const override { return last_turn_; }
    void set_angle_branches(const std::vector<double>& angle_branches) override {
        last_turn_ = angle_branches;
    }
    std::size_t bytes() const override { return each_.capacity() * sizeof(Each); }

    Index elements() const override { return static_cast<Index>(each_.size()); }
    int strains_per_element() const override { return 1; }
    Strains strains(const double* q) override;
    Strains strain_rates(const double* p) override;
    Strains stresses(const Strains& strains) const override;
    void add_forces(const Strains& stresses, Residual& out) override;

    Strains rates(const double* q, const double* v) const override;
    void rates_vjp(const double* q, const double* v, const Strains& by_rates, VectorXd& by_q, VectorXd& by_v,
                   Gradient& out) const override;
    void add_cancelling_stage_forces(double beyond, VectorXd& out) const override;

  private:
    using Corners = JointForm::Corners;
    struct Each {  // one scalar strain
        LinkPair links;
        JointForm form;
        double share;  // fraction of the joint's damping
        ParameterSlice slice;
        ParameterSlice axis;  // if the joint has an axis
        Joint joint;
        std::size_t number;  // among the strains of the joint
        bool length;
        JointForm::Corners at_rest;  // |ds/dx|
        double reach;
        std::vector<ParameterSlice> numbers;  // of a kind that has some: the pitch of a screw
        double damping = 0.0;
    };
    double strain(std::size_t k, const JointForm::Corners& at) const {
        return each_[k].form.value(at, last_turn_[k]);
    }
    double stress_by_damping(std::size_t k, double strain) const;
    /// Returns the derivative of ds/dt by the joint's axis.
    Vec3 rate_by_axis(const Each& each, const double* q, const Corners& v) const;
    JointForm::Local local(const Each& each, const double* q) const {
        return each.form.at(each.links.positions(q));
    }

    std::vector<Each> each_;
    std::vector<JointForm::Local> now_;  // at the last evaluated state
    std::vector<double> last_turn_;
};

}  // namespace magshell
