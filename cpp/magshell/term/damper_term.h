// Dampers in the joints of skeletons: a torque against the rate of the joint's coordinate, of a ball joint against the rate
// at which its links turn to each other.
//
// They are elastic terms without elasticity: their strains are the coordinates s, and in a stage of a time step, with what
// set_history says,
//
//   sigma = d (s - s^)/(a dt),       -d s' of the method's own rate, so of its order, with a symmetric matrix
//
// For a ball joint s are the nine products of the axes of both links: sum s'^2 = 2 omega^2.
#pragma once

#include <string>
#include <vector>

#include "magshell/term/elastic_term.h"
#include "magshell/term/joint_form.h"

namespace magshell {

class DamperTerm final : public ElasticTerm {
  public:
    struct Input {
        std::string owner;
        Joint joint;
        const Index* parent;  // four corners, or nullptr: the world
        const Index* child;
    };

    DamperTerm(const std::vector<Input>& joints, const std::vector<Vec3>& rest, const SystemMatrix& matrix,
               Registry& registry);

    std::string_view name() const override { return "joints"; }
    bool set_values(const Values& values) override;
    double energy(const double*, const Controls&) const override { return 0.0; }
    void evaluate(const double* q, const Controls& controls, Residual& out) override;
    void finish_assembly(const double* q, const Controls& controls, SystemMatrix& out) const override;
    void vjp(const double* q, const Controls& controls, const double* lambda, Gradient& out) override;
    std::vector<double> angle_branches() const override { return last_turn_; }
    void set_angle_branches(const std::vector<double>& turns) override { last_turn_ = turns; }
    std::size_t bytes() const override { return each_.capacity() * sizeof(Each); }

    Index elements() const override { return static_cast<Index>(each_.size()); }
    int strains_per_element() const override { return 1; }
    Strains strains(const double* q) override;
    Strains strain_rates(const double* p) override;
    Strains stresses(const Strains& strains) const override;
    void add_forces(const Strains& stresses, Residual& out) override;

    /// ds/dt at q, as the nodes move by v; and the gradients by q, v and values of a number that knows its own by them.
    Strains rates(const double* q, const double* v) const;
    void rates_vjp(const double* q, const double* v, const Strains& by_rates, VectorXd& by_q, VectorXd& by_v,
                   Gradient& out) const;

    /// The magnitude of forces that cancel in a stage, with coordinates larger than at rest by `beyond` [m].
    void add_cancelling_stage_forces(double beyond, VectorXd& out) const;

  private:
    using Corners = JointForm::Corners;
    struct Each {  // a scalar
        LinkPair links;
        JointForm form;
        double share;  // of the joint's damping
        Slot slot;
        Slot axis;  // of a joint that has one
        Joint joint;
        bool length;
        JointForm::Corners at_rest;  // |ds/dx|
        double reach, damping = 0.0;
    };
    double strain(std::size_t k, const JointForm::Corners& at) const {
        return each_[k].form.value(at, last_turn_[k]);
    }
    double stress_by_damping(std::size_t k, double strain) const;
    /// d(ds/dt) by the axis.
    Vec3 rate_by_axis(const Each& each, const double* q, const Corners& v) const;
    JointForm::Local local(const Each& each, const double* q) const {
        return each.form.at(each.links.positions(q));
    }

    std::vector<Each> each_;
    std::vector<JointForm::Local> now_;  // at the last evaluated state
    std::vector<double> last_turn_;
};

}  // namespace magshell
