// Joints between a link of a skeleton and its parent. A kind of joint is one class of joint_kinds.cpp, with one row in its table; all other
// code asks JointKind and compares no kinds.
//
// A kind defines the pose of the child relative to the parent as a function of its coordinates. Each coordinate moves the child, and all
// links beyond it, along a screw: it rotates them about an axis, with a translation along this axis, or it only translates them.
#pragma once

#include <string_view>
#include <utility>
#include <vector>

#include "magshell/core/parameters.h"
#include "magshell/core/types.h"
#include "magshell/energy/joint_law.h"

namespace magshell {

struct Joint;

/// One of the two sides of a joint: the current position of its origin as a point of the link [m], and the rotation of the link.
struct JointSide {
    Vec3 origin;
    Mat3 rotation;
};

/// The motion by one coordinate, a column of B (skeleton_coordinates.h).
struct JointColumn {
    bool is_rotation;    // about w through o, else a translation along w
    Vec3 axis;           // w, a unit vector
    Vec3 origin;         // o, a point on the axis of a rotation [m]
    double scale;        // angle or displacement per unit of the coordinate: 1/l [rad/m] or 1
    double pitch = 0.0;  // translation along the axis of a rotation, per angle [m/rad]
};

/// The coordinate of a joint in terms of vectors y_p fixed to the parent and y_c fixed to the child, all given in the reference
/// configuration.
///
///   sum y_p . y_c + a . (o_c - o_p)                  the coordinate itself, o_p and o_c the origin as a point of the parent and the child
///   arg(sum y_p . y_c + i sum of the sines)          an angle, if there are sines
///   top - c (1 - cos s) = sum y_p . y_c              an angle s that is never negative, if c > 0
struct JointCoordinate {
    struct Product {
        Vec3 of_parent, of_child;
        double factor = 1.0;
    };
    std::vector<Product> products = {}, sines = {};
    Vec3 along = Vec3::Zero();       // a
    double top = 0.0, cosine = 0.0;  // cosine: c
    Vec3 slide =
        Vec3::Zero();  // of a screw's angle: a / h, whose product with o_c - o_p counts the full turns
};

/// A quantity whose rate a damper acts against, with its share of the damping.
struct JointStrain {
    JointCoordinate coordinate;
    double share = 1.0;
};

/// The sums of SkeletonCoordinates::SubtreeSums for the child, about the origin of the joint as a point of the parent.
struct JointSums {
    Mat3 to_parent;                                   // from world axes to those of the parent
    Vec3 parent_rate, child_rate;                     // angular velocities of the parent and the child
    Vec3 by_translation, force, by_rotation, moment;  // as in SubtreeSums
};

class JointKind {
  public:
    struct Number {
        const char *name, *unit;
    };
    struct Traits {
        std::string_view name;     // that of the table in python/magshell/model/rigid/joints.py
        Index freedom;             // number of coordinates
        bool has_origin = true;    // otherwise it is the center of the child
        bool has_axis = false;     // whether its motion has an axis
        bool rotates = false;      // whether one of its coordinates rotates the child
        bool has_lengths = false;  // whether its coordinates are lengths, not angles
        bool has_world_columns =
            false;          // whether its rotations are about the world axes, also if earlier links rotate
        Number motor = {};  // the target of its motor
        JointLaw::Names law = {};          // the parameters of the energy of its coordinate
        std::vector<Number> numbers = {};  // parameters of its own, besides origin and axis
    };

    /// Returns the kind of this name. Throws std::out_of_range if there is none.
    static const JointKind& of(std::string_view name);

    virtual ~JointKind() = default;
    const Traits& traits() const { return traits_; }

    /// Appends the motion by each coordinate. radians: 1/l of the child.
    virtual void add_columns(const Joint& joint, const JointSide& parent, const JointSide& child,
                             double radians, std::vector<JointColumn>& out) const = 0;
    /// Returns the side of the child after the coordinates change by z [m], the angles by z/length. parent, child: the sides before; to:
    /// that of the parent afterwards.
    virtual JointSide moved(const Joint& joint, const JointSide& parent, const JointSide& child,
                            const JointSide& to, const double* z, double length) const = 0;

    // Functions of kinds with one coordinate:

    /// Returns the coordinate, an angle [rad] from -pi to pi or a length [m].
    virtual double coordinate(const Joint& joint, const JointSide& parent, const JointSide& child) const;
    /// Returns the gradient with respect to the axis, which may have a part along it. s: the coordinate; rate: its rate.
    virtual Vec3 axis_gradient(const Joint& joint, double s, double rate, const JointSums& sums) const;
    /// Returns the gradient by one of its own numbers.
    virtual double number_gradient(const Joint& joint, std::size_t number, double s, double rate,
                                   const JointSums& sums) const;

    // Functions of kinds with springs, dampers or motors:

    /// Returns the coordinate in terms of vectors fixed to the links.
    virtual JointCoordinate form(const Joint& joint) const;
    /// Returns the quantities whose rates a damper acts against; by default the coordinate.
    virtual std::vector<JointStrain> damped(const Joint& joint) const;
    /// Returns how far the coordinates are from the target of the motor [m], angles times length; a rotation takes the shorter way.
    virtual Vec3 motor_increment(const Joint& joint, const JointSide& parent, const JointSide& child,
                                 const Vec3& target, double length) const;
    /// Returns the gradient with respect to the target, given that with respect to the coordinates in their own units. frame: rotation of
    /// the parent.
    virtual Vec3 target_gradient(const Mat3& frame, const Vec3& target, const Vec3& by_coordinates) const;

  protected:
    explicit JointKind(Traits traits) : traits_(std::move(traits)) {}

  private:
    /// Throws std::logic_error.
    [[noreturn]] void undefined(const char* function) const;

    Traits traits_;
};

/// A joint. Origin and axis are in world coordinates of the reference configuration; the axis is a unit vector, zero without one. A ball
/// joint may have an axis, that of a cone which limits its rotation.
struct Joint {
    const JointKind* kind = &JointKind::of("free");
    Index parent = -1;  // index of an earlier link of the same skeleton; negative: the world
    Vec3 origin = Vec3::Zero(), axis = Vec3::Zero();
    std::vector<double> numbers = {};  // JointKind::Traits::numbers
    bool has_motor = false;            // a motor prescribes its coordinate or rotation
    bool has_damper = false;           // a damper acts in it
    bool has_torque = false;           // a ball joint with an applied moment
    bool has_servo = false;            // a ball joint with a servo
    bool has_cone = false;             // a ball joint whose axis is limited to a cone

    const JointKind::Traits& traits() const { return kind->traits(); }
    bool has_axis() const { return traits().has_axis; }
    /// Returns its number of degrees of freedom.
    Index freedom() const { return traits().freedom; }
    /// Registers the numbers of its kind.
    std::vector<ParameterSlice> add_numbers(const std::string& owner, Parameters& parameters) const;
    /// Replaces the numbers by those of the slices that have changed. Returns true if there are any.
    bool replace_numbers(const Values& values, const std::vector<ParameterSlice>& slices);
};

}  // namespace magshell
