// JointTerm: springs, torques, servos and limits that act in the joints of skeletons, and springs that close
// kinematic loops.
//
// The coordinate s of a joint is computed from the corners of its two links (joint_form.h). A ball joint has up
// to three coordinates, each an angle known by its cosine, form = top - c (1 - cos s): the angle of its
// rotation, the angle from there to a servo's target rotation, and the angle of an axis from its reference
// direction, which a cone limits. A loop closure pulls a point of one link to a point of another: k/2 |o_c -
// o_p|^2.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "magshell/energy/joint_law.h"
#include "magshell/terms/joint/joint_form.h"
#include "magshell/terms/stress_rate_term.h"
#include "magshell/terms/term.h"

namespace magshell {

class JointTerm final : public Term, public StressRateTerm {
  public:
    enum class Act { coordinate, ball_servo, cone, closure };
    struct Input {
        std::string owner;
        Joint joint;
        const Index* parent;  // four corners; nullptr for the world
        const Index* child;
        Act act = Act::coordinate;
    };

    JointTerm(const std::vector<Input>& joints, const std::vector<Vec3>& rest, const SystemMatrix& matrix,
              Registry& registry);

    std::string_view name() const override { return "joints"; }
    bool set_values(const Values& values) override;
    bool depends_on_loads() const override { return false; }
    double energy(const double* q, const LoadParameters& load_parameters) const override;
    void evaluate(const double* q, const LoadParameters& load_parameters, Residual& out) override;
    void finish_assembly(const double* q, const LoadParameters& load_parameters,
                         SystemMatrix& out) const override;
    void add_cancelling_forces(double beyond, VectorXd& out) const override;
    void vjp(const double* q, const LoadParameters& load_parameters, const double* lambda,
             Gradient& out) override;
    void freeze_stress_rates(const double* p) override;
    void release_stresses() override { frozen_.reset(); }
    std::vector<double> angle_branches() const override { return last_turn_; }
    void set_angle_branches(const std::vector<double>& angle_branches) override {
        last_turn_ = angle_branches;
    }
    std::size_t bytes() const override { return each_.capacity() * sizeof(Each); }

  private:
    struct Each {
        Act act;
        Joint joint;
        LinkPair links;
        JointForm form;
        CornerSum gap;                // of a loop closure
        CornerForm::Corners at_rest;  // |d(form)/dx|; of a loop closure |d(gap)/dx|
        double reach;  // magnitude that round-off is proportional to: [m], or in link lengths for angles
        double top = 0.0, cosine = 0.0;      // c; zero if the form is the coordinate itself (JointCoordinate)
        std::vector<ParameterSlice> slices;  // of the law; the stiffness of a loop closure
        ParameterSlice
            geometry;  // parameter of the form: axis, origin of a loop closure, or a servo's target rotation
        std::vector<ParameterSlice> numbers;  // of a kind that has some: the pitch of a screw
        Vec3 target_rotation = Vec3::Zero();  // rotation vector [rad]
        JointLaw law;
        double stiffness = 0.0;  // of a loop closure

        void find_form();
        bool length() const { return act == Act::closure || joint.traits().has_lengths; }
    };
    /// The coordinate of a joint at a state, with E' and E'' by its form.
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
    void geometry_vjp(const Each& joint, const State& now, const double* q, const CornerForm::Corners& rate,
                      Gradient& out) const;

    std::vector<Each> each_;
    std::vector<double> last_turn_;
    // At the last evaluated state: the derivatives of the form of each joint, and E'' by it.
    struct Slope {
        CornerForm::Corners first = CornerForm::Corners::Zero();
        double by_second = 0.0;
    };
    std::vector<Slope> slopes_;
    // While stresses are held at their rates: those of dE/d(form) of each joint, and of the force of a loop closure.
    struct FrozenRate {
        double by_first = 0.0;
        Vec3 pull = Vec3::Zero();
    };
    std::optional<std::vector<FrozenRate>> frozen_;
};

}  // namespace magshell
