// What acts in the joints of skeletons: springs, torques, servos, limits; and closures of loops.
//
// The coordinate s of a joint is read off the corners of its two links, as joint_form.h says. Of a ball joint there are three,
// all angles by their cosine, form = top - c (1 - cos s): that of the rotation, that from the rotation which a servo wants to
// it, and that by which an axis is off, which a cone limits.
// A closure pulls a point of one link to a point of another: k/2 |o_c - o_p|^2.
#pragma once

#include <string>
#include <vector>

#include "magshell/energy/joint_law.h"
#include "magshell/term/joint_form.h"
#include "magshell/term/term.h"

namespace magshell {

class JointTerm final : public Term {
  public:
    enum class Act { coordinate, ball_servo, cone, closure };
    struct Input {
        std::string owner;
        Joint joint;
        const Index* parent;  // four corners, or nullptr: the world
        const Index* child;
        Act act = Act::coordinate;
    };

    JointTerm(const std::vector<Input>& joints, const std::vector<Vec3>& rest, const SystemMatrix& matrix,
              Registry& registry);

    std::string_view name() const override { return "joints"; }
    bool set_values(const Values& values) override;
    bool driven() const override { return false; }
    double energy(const double* q, const Controls& controls) const override;
    void evaluate(const double* q, const Controls& controls, Residual& out) override;
    void finish_assembly(const double* q, const Controls& controls, SystemMatrix& out) const override;
    void add_cancelling_forces(double beyond, VectorXd& out) const override;
    void vjp(const double* q, const Controls& controls, const double* lambda, Gradient& out) override;
    std::vector<double> angle_branches() const override { return last_turn_; }
    void set_angle_branches(const std::vector<double>& turns) override { last_turn_ = turns; }
    std::size_t bytes() const override { return each_.capacity() * sizeof(Each); }

  private:
    struct Each {
        Act act;
        Joint joint;
        LinkPair links;
        JointForm form;
        CornerSum gap;                // of a closure
        CornerForm::Corners at_rest;  // |d(form)/dx|, of a closure |d(gap)/dx|
        double reach;  // what rounds at rest: a length, in lengths of a link where the coordinate is an angle
        double top = 0.0, cosine = 0.0;  // c; zero where the form is the coordinate
        std::vector<Slot> slots;         // of the law; of a closure, its stiffness
        Slot place;  // what the form depends on: axis, origin of a closure, what a servo wants
        Vec3 wanted = Vec3::Zero();  // the rotation vector
        JointLaw law;
        double stiffness = 0.0;  // of a closure

        void find_form();
        bool length() const { return act == Act::closure || joint.kind == JointKind::prismatic; }
    };
    /// What of a joint a state tells: E' and E'' by its form.
    struct State {
        JointForm::Local form;
        double coordinate, by_first, by_second;
        double share;  // d(coordinate)/d(form)
    };

    double coordinate(std::size_t k, const CornerForm::Corners& at) const;
    State state(std::size_t k, const double* q) const;
    Vec3 gap(const Each& joint, const CornerForm::Corners& at) const;
    static JointEnergy law_at(const Each& joint, double coordinate) { return {joint.law, coordinate}; }
    void closure_vjp(const Each& joint, const double* q, const CornerForm::Corners& rate,
                     Gradient& out) const;
    void place_vjp(const Each& joint, const State& now, const double* q, const CornerForm::Corners& rate,
                   Gradient& out) const;

    std::vector<Each> each_;
    std::vector<double> last_turn_;
};

}  // namespace magshell
