// The kinds of joints: one class each, and the table of them at the end.

#include <Eigen/Geometry>
#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>
#include <stdexcept>
#include <string>

#include "magshell/core/rotation_vector.h"
#include "magshell/dofs/joint.h"
#include "magshell/dofs/rigid_nodes.h"

namespace magshell {
namespace {

// Returns a unit vector perpendicular to an axis.
Vec3 across(const Vec3& axis) {
    Index smallest;
    axis.cwiseAbs().minCoeff(&smallest);
    return axis.cross(Vec3::Unit(smallest)).normalized();
}

// Returns the angle of the rotation about an axis that is nearest to a given rotation.
double angle_about(const Vec3& axis, const Mat3& turn) {
    const Vec3 u = across(axis), v = axis.cross(u);
    return std::atan2(v.dot(turn * u) - u.dot(turn * v), u.dot(turn * u) + v.dot(turn * v));
}

// Returns the rotation by three coordinates [m].
Mat3 turn_by(const double* z, double length) {
    return rotation(Vec3(z[0], z[1], z[2]) / length);
}

void add_rotations_about_world_axes(const Vec3& origin, double radians, std::vector<JointColumn>& out) {
    for (int c = 0; c < 3; ++c) out.push_back({true, Vec3::Unit(c), origin, radians});
}

// Six degrees of freedom: translations, then rotations about the center of the child.
class FreeJoint final : public JointKind {
  public:
    FreeJoint() : JointKind({.name = "free", .freedom = 6, .has_origin = false, .rotates = true}) {}

    void add_columns(const Joint&, const JointSide&, const JointSide& child, double radians,
                     std::vector<JointColumn>& out) const override {
        for (int c = 0; c < 3; ++c) out.push_back({false, Vec3::Unit(c), child.origin, 1.0});
        add_rotations_about_world_axes(child.origin, radians, out);
    }
    JointSide moved(const Joint&, const JointSide&, const JointSide& child, const JointSide&, const double* z,
                    double length) const override {
        return {child.origin + Vec3(z[0], z[1], z[2]), turn_by(z + 3, length) * child.rotation};
    }
};

// No degree of freedom.
class FixedJoint final : public JointKind {
  public:
    FixedJoint() : JointKind({.name = "fixed", .freedom = 0}) {}

    void add_columns(const Joint&, const JointSide&, const JointSide&, double,
                     std::vector<JointColumn>&) const override {}
    JointSide moved(const Joint&, const JointSide&, const JointSide&, const JointSide& to, const double*,
                    double) const override {
        return to;
    }
};

const JointLaw::Names law_of_angles = {"spring_stiffness", "rest_angle",     "torque",      "target_angle",
                                       "servo_stiffness",  "torque_limit",   "lower_limit", "upper_limit",
                                       "limit_stiffness",  "limit_smoothing"};

// Rotates about the axis.
class RevoluteJoint : public JointKind {
  public:
    RevoluteJoint()
        : RevoluteJoint({.name = "revolute",
                         .freedom = 1,
                         .has_axis = true,
                         .rotates = true,
                         .motor = {"motor_angle", "SI"},
                         .law = law_of_angles}) {}

    void add_columns(const Joint& joint, const JointSide& parent, const JointSide&, double radians,
                     std::vector<JointColumn>& out) const override {
        out.push_back({true, parent.rotation * joint.axis, parent.origin, radians});
    }
    JointSide moved(const Joint& joint, const JointSide& parent, const JointSide& child, const JointSide& to,
                    const double* z, double length) const override {
        const double s = coordinate(joint, parent, child) + z[0] / length;
        return {to.origin, to.rotation * rotation(s * joint.axis)};
    }
    double coordinate(const Joint& joint, const JointSide& parent, const JointSide& child) const override {
        return angle_about(joint.axis, parent.rotation.transpose() * child.rotation);
    }
    Vec3 axis_gradient(const Joint& joint, double s, double rate, const JointSums& sums) const override {
        const Vec3& axis = joint.axis;
        const Vec3 by_turn = sums.to_parent * (sums.by_rotation + sums.moment.cross(sums.parent_rate)),
                   by_rate = rate * (sums.to_parent * sums.moment);
        return std::sin(s) * by_turn + (1.0 - std::cos(s)) * by_turn.cross(axis) + std::cos(s) * by_rate +
               std::sin(s) * by_rate.cross(axis);
    }
    // s = arg(C + i S),  C = u_p . u_c + v_p . v_c,  S = v_p . u_c - u_p . v_c      u, v perpendicular to the axis
    JointCoordinate form(const Joint& joint) const override {
        const Vec3 u = across(joint.axis), v = joint.axis.cross(u);
        return {.products = {{u, u}, {v, v}}, .sines = {{v, u}, {u, v, -1.0}}};
    }
    Vec3 motor_increment(const Joint& joint, const JointSide& parent, const JointSide& child,
                         const Vec3& target, double length) const override {
        const double off = target[0] - coordinate(joint, parent, child);
        return {length * std::remainder(off, 2.0 * std::numbers::pi), 0.0, 0.0};
    }

  protected:
    explicit RevoluteJoint(Traits traits) : JointKind(std::move(traits)) {}
};

// Rotates about the axis by s and translates along it by h s. The pitch h [m/rad] is its number.
class ScrewJoint final : public RevoluteJoint {
  public:
    ScrewJoint()
        : RevoluteJoint({.name = "screw",
                         .freedom = 1,
                         .has_axis = true,
                         .rotates = true,
                         .motor = {"motor_angle", "SI"},
                         .law = law_of_angles,
                         .numbers = {{"pitch", "m/rad"}}}) {}

    void add_columns(const Joint& joint, const JointSide& parent, const JointSide&, double radians,
                     std::vector<JointColumn>& out) const override {
        out.push_back({true, parent.rotation * joint.axis, parent.origin, radians, joint.numbers[0]});
    }
    JointSide moved(const Joint& joint, const JointSide& parent, const JointSide& child, const JointSide& to,
                    const double* z, double length) const override {
        const double s = coordinate(joint, parent, child) + z[0] / length;
        return {to.origin + joint.numbers[0] * s * (to.rotation * joint.axis),
                to.rotation * rotation(s * joint.axis)};
    }
    // The displacement tells the number of full turns.
    double coordinate(const Joint& joint, const JointSide& parent, const JointSide& child) const override {
        const double slid = joint.axis.dot(parent.rotation.transpose() * (child.origin - parent.origin)) /
                            joint.numbers[0],
                     turned = RevoluteJoint::coordinate(joint, parent, child);
        return slid + std::remainder(turned - slid, 2.0 * std::numbers::pi);
    }
    JointCoordinate form(const Joint& joint) const override {
        JointCoordinate coordinate = RevoluteJoint::form(joint);
        coordinate.slide = joint.axis / joint.numbers[0];
        return coordinate;
    }
    // The rotation is about the origin as a point of the child, and the translation changes with the axis.
    Vec3 axis_gradient(const Joint& joint, double s, double rate, const JointSums& sums) const override {
        const double pitch = joint.numbers[0];
        const Vec3 off = pitch * s * (sums.to_parent.transpose() * joint.axis);
        JointSums of_child = sums;
        of_child.by_rotation -= off.cross(sums.by_translation) + sums.child_rate.cross(off).cross(sums.force);
        of_child.moment -= off.cross(sums.force);
        return RevoluteJoint::axis_gradient(joint, s, rate, of_child) +
               pitch * by_displacement(s, rate, sums);
    }
    double number_gradient(const Joint& joint, std::size_t, double s, double rate,
                           const JointSums& sums) const override {
        return joint.axis.dot(by_displacement(s, rate, sums));
    }
    Vec3 motor_increment(const Joint& joint, const JointSide& parent, const JointSide& child,
                         const Vec3& target, double length) const override {
        return {length * (target[0] - coordinate(joint, parent, child)), 0.0, 0.0};
    }

  private:
    // Returns the gradient with respect to a vector b of the parent, for a translation by s b.
    static Vec3 by_displacement(double s, double rate, const JointSums& sums) {
        return sums.to_parent *
               (s * (sums.by_translation + sums.force.cross(sums.parent_rate)) + rate * sums.force);
    }
};

// Translates along the axis.
class PrismaticJoint final : public JointKind {
  public:
    PrismaticJoint()
        : JointKind({.name = "prismatic",
                     .freedom = 1,
                     .has_axis = true,
                     .has_lengths = true,
                     .motor = {"motor_displacement", "SI"},
                     .law = {"spring_stiffness", "rest_displacement", "force", "target_displacement",
                             "servo_stiffness", "force_limit", "lower_limit", "upper_limit",
                             "limit_stiffness", "limit_smoothing"}}) {}

    void add_columns(const Joint& joint, const JointSide& parent, const JointSide&, double,
                     std::vector<JointColumn>& out) const override {
        out.push_back({false, parent.rotation * joint.axis, parent.origin, 1.0});
    }
    JointSide moved(const Joint& joint, const JointSide& parent, const JointSide& child, const JointSide& to,
                    const double* z, double) const override {
        const double s = coordinate(joint, parent, child) + z[0];
        return {to.origin + s * (to.rotation * joint.axis), to.rotation};
    }
    double coordinate(const Joint& joint, const JointSide& parent, const JointSide& child) const override {
        return joint.axis.dot(parent.rotation.transpose() * (child.origin - parent.origin));
    }
    Vec3 axis_gradient(const Joint&, double s, double rate, const JointSums& sums) const override {
        return sums.to_parent *
               (s * (sums.by_translation + sums.force.cross(sums.parent_rate)) + rate * sums.force);
    }
    JointCoordinate form(const Joint& joint) const override { return {.along = joint.axis}; }
    Vec3 motor_increment(const Joint& joint, const JointSide& parent, const JointSide& child,
                         const Vec3& target, double) const override {
        return {target[0] - coordinate(joint, parent, child), 0.0, 0.0};
    }
};

// Rotates about the origin.
class BallJoint final : public JointKind {
  public:
    BallJoint()
        : JointKind({.name = "ball",
                     .freedom = 3,
                     .rotates = true,
                     .has_world_columns = true,
                     .motor = {"motor_rotation", "rad"},
                     .law = {"spring_stiffness", nullptr, nullptr, nullptr, nullptr, nullptr, nullptr,
                             "upper_limit", "limit_stiffness", "limit_smoothing"}}) {}

    void add_columns(const Joint&, const JointSide& parent, const JointSide&, double radians,
                     std::vector<JointColumn>& out) const override {
        add_rotations_about_world_axes(parent.origin, radians, out);
    }
    JointSide moved(const Joint&, const JointSide& parent, const JointSide& child, const JointSide& to,
                    const double* z, double length) const override {
        return {to.origin,
                to.rotation * orthonormal(parent.rotation.transpose() * turn_by(z, length) * child.rotation)};
    }
    // sum e_p . e_c = 1 + 2 cos(angle of the rotation)
    JointCoordinate form(const Joint&) const override {
        JointCoordinate form{.top = 3.0, .cosine = 2.0};
        for (int c = 0; c < 3; ++c) form.products.push_back({Vec3::Unit(c), Vec3::Unit(c)});
        return form;
    }
    // The nine products between the axes of both links: the sum of the squares of their rates is 2 omega^2.
    std::vector<JointStrain> damped(const Joint&) const override {
        std::vector<JointStrain> all;
        for (int a = 0; a < 3; ++a)
            for (int b = 0; b < 3; ++b) all.push_back({{.products = {{Vec3::Unit(a), Vec3::Unit(b)}}}, 0.5});
        return all;
    }
    Vec3 motor_increment(const Joint&, const JointSide& parent, const JointSide& child, const Vec3& target,
                         double length) const override {
        const Eigen::AngleAxisd turn(
            orthonormal(parent.rotation * rotation(target) * child.rotation.transpose()));
        return length * turn.angle() * turn.axis();
    }
    Vec3 target_gradient(const Mat3& frame, const Vec3& target, const Vec3& by_coordinates) const override {
        return transposed_jacobian_times(target, frame.transpose() * by_coordinates);
    }
};

}  // namespace

const JointKind& JointKind::of(std::string_view name) {
    static const FreeJoint free;
    static const FixedJoint fixed;
    static const RevoluteJoint revolute;
    static const ScrewJoint screw;
    static const PrismaticJoint prismatic;
    static const BallJoint ball;
    static const std::array<const JointKind*, 6> table = {&free,  &fixed,     &revolute,
                                                          &screw, &prismatic, &ball};
    const auto* const found =
        std::ranges::find(table, name, [](const JointKind* kind) { return kind->traits().name; });
    if (found == table.end()) throw std::out_of_range("there is no kind of joint " + std::string(name));
    return **found;
}

// Defaults of the functions that a kind without coordinate, axis, numbers, energy or motor does not define.

double JointKind::coordinate(const Joint&, const JointSide&, const JointSide&) const {
    undefined("coordinate");
}

Vec3 JointKind::axis_gradient(const Joint&, double, double, const JointSums&) const {
    undefined("axis_gradient");
}

double JointKind::number_gradient(const Joint&, std::size_t, double, double, const JointSums&) const {
    undefined("number_gradient");
}

JointCoordinate JointKind::form(const Joint&) const {
    undefined("form");
}

std::vector<JointStrain> JointKind::damped(const Joint& joint) const {
    return {{form(joint)}};
}

Vec3 JointKind::motor_increment(const Joint&, const JointSide&, const JointSide&, const Vec3&, double) const {
    undefined("motor_increment");
}

Vec3 JointKind::target_gradient(const Mat3&, const Vec3&, const Vec3& by_coordinates) const {
    return by_coordinates;
}

std::vector<ParameterSlice> Joint::add_numbers(const std::string& owner, Parameters& parameters) const {
    std::vector<ParameterSlice> slices;
    for (const auto& [name, unit] : traits().numbers)
        slices.push_back(parameters.add(owner, name, unit, 1, 1));
    return slices;
}

bool Joint::replace_numbers(const Values& values, const std::vector<ParameterSlice>& slices) {
    bool replaced = false;
    for (std::size_t n = 0; n < slices.size(); ++n) {
        if (!values.changed(slices[n])) continue;
        numbers[n] = values.number(slices[n]);
        replaced = true;
    }
    return replaced;
}

void JointKind::undefined(const char* function) const {
    throw std::logic_error("a " + std::string(traits_.name) + " joint has no " + function);
}

}  // namespace magshell
