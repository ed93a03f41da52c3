// Contacts: all contact of a scene, of points with obstacles and of bodies with each other. Without contact every answer is empty or
// zero, so callers need not ask whether there is any.
#pragma once

#include <string>
#include <vector>

#include "magshell/terms/contact/body_contact_term.h"
#include "magshell/terms/contact/contact_term.h"
#include "magshell/terms/force_term.h"

namespace magshell {

class Contacts {
  public:
    using ObstaclePoint = ContactTerm::ActiveContact;

    /// Adds the term of contact with obstacles, or that of contact between bodies.
    void add(ContactTerm* obstacles) { obstacles_ = obstacles; }
    void add(BodyContactTerm* bodies) { bodies_ = bodies; }
    /// Adds the friction of one of them.
    void add(ForceTerm* friction) { frictions_.push_back(friction); }
    /// Returns true if there is any contact.
    bool any() const { return obstacles_ || bodies_; }

    /// Multiplies all contact forces, with friction, by a factor from now on, until it is set to 1 again.
    void set_factor(double factor) const;
    /// Adds to `out` minus the forces of contact and friction at q, the last evaluated state, with their factor.
    void evaluate(const VectorXd& q, const Kinematics& at, const LoadParameters& load_parameters,
                  Residual& out) const;
    /// Adds their Hessian and the derivatives of friction at that state, as the assembly of a model does.
    void assemble(const VectorXd& q, const Kinematics& at, const LoadParameters& load_parameters,
                  SystemMatrix& out, NonsymmetricTangent& rest) const;
    /// Add what Term::vjp of contact, and ForceTerm::vjp of friction, add at that state.
    void vjp(const VectorXd& q, const Kinematics& at, const LoadParameters& load_parameters,
             const VectorXd& lambda, KinematicsGradient& by, Gradient& out) const;

    /// Adds what their add_rest_vjp() add at that state.
    void add_rest_vjp(const VectorXd& q, const LoadParameters& load_parameters, const VectorXd& lambda,
                      VectorXd& out) const;

    /// Returns the points in contact with obstacles at the last evaluated state; with q, those at q.
    std::vector<ObstaclePoint> obstacle_points() const;
    std::vector<ObstaclePoint> obstacle_points(const VectorXd& q,
                                               const LoadParameters& load_parameters) const;
    /// Returns the points at the last evaluated state with the forces predicted linearly for a step p from there.
    std::vector<ObstaclePoint> predicted_points(const VectorXd& p) const;
    const ContactPoint& point(const ObstaclePoint& active) const { return obstacles_->point(active); }
    const ContactLaw& law(const ObstaclePoint& active) const { return obstacles_->law(active); }
    /// Returns the norm of the change of the contact forces along a step p [N], between the points in contact at the last evaluated
    /// state and earlier ones.
    double force_change(const std::vector<ObstaclePoint>& earlier, const VectorXd& p) const;

    /// Every point that may come into contact in the frame of its obstacle [m], and two rotation vectors of each obstacle [rad].
    struct ObstacleFrames {
        std::vector<Vec3> positions, rotation_vectors;
    };
    ObstacleFrames obstacle_frames(const VectorXd& q, const LoadParameters& load_parameters) const;
    std::vector<Vec3> obstacle_rotations(const LoadParameters& load_parameters) const;
    /// Watches these obstacles from now on, and no others: their middles may not pass through faces.
    void watch(const Nodes& nodes, const std::vector<WatchedObstacle>& watched) const;
    /// Returns the first passage of a point through an obstacle, or of a watched obstacle through a face, between two such sets of
    /// positions.
    Passage first_crossing(const ObstacleFrames& before, const ObstacleFrames& after) const;
    /// Returns the same on the straight path from q to `end`.
    Passage first_crossing(const VectorXd& q, const LoadParameters& load_parameters, const VectorXd& end,
                           const LoadParameters& load_parameters_at_end) const;

    /// Returns true if anything is in contact at q.
    bool acts(const VectorXd& q, const LoadParameters& load_parameters) const {
        return has_active_pairs(q) || (obstacles_ && obstacles_->acts(q.data(), load_parameters));
    }
    /// Returns the energy of all contact [J].
    double energy(const VectorXd& q, const LoadParameters& load_parameters) const;
    /// Returns true if a pair of faces or edges is in contact at the last evaluated state; with q, at q.
    bool has_active_pairs() const { return bodies_ && !bodies_->evaluated_contacts().empty(); }
    bool has_active_pairs(const VectorXd& q) const { return bodies_ && bodies_->acts(q.data()); }
    /// Returns true if pairs of the beginning of the step have friction, wherever they are now.
    bool has_lagged_pairs() const { return bodies_ && bodies_->has_extra_couplings(); }
    /// Returns the directional derivative of that energy along p [J] at the last evaluated state; with q, at q.
    double slope(const VectorXd& p) const { return bodies_ ? bodies_->slope(p.data()) : 0.0; }
    double slope(const VectorXd& q, const VectorXd& p) const {
        return bodies_ ? bodies_->slope(q.data(), p.data()) : 0.0;
    }
    /// Returns its second derivative along p at the last evaluated state [J], without the part of rotating normals.
    double curvature(const VectorXd& p) const { return bodies_ ? bodies_->curvature(p.data()) : 0.0; }
    /// Names the two faces with the largest contact force at the last evaluated state; empty without contact.
    std::string describe_largest_force() const { return bodies_ ? bodies_->hardest() : std::string(); }
    /// Says which faces limit a step p from q to this length; empty if none do.
    std::string describe_blocking(const VectorXd& q, const VectorXd& p, double length) const;

    /// Switches the smooth contact laws off while another method enforces contact.
    void set_switched_off(bool off) const;
    /// Returns the vertices and pairs that hard contact constrains. The first throws InvalidInput if points on faces are in contact, or
    /// if a contact has different static and kinetic coefficients of friction.
    std::vector<ContactTerm::HardContact> hard_points() const;
    std::vector<BodyContactTerm::HardContactPair> hard_pairs(const VectorXd& q) const;
    ObstacleState obstacle_state(Index obstacle, const LoadParameters& load_parameters) const {
        return obstacles_->obstacle_state(obstacle, load_parameters);
    }
    /// Adds the stiffness of the active pairs of bodies at the last evaluated state.
    void add_pair_stiffness(std::vector<PairStiffness>& out) const;
    /// Adds the magnitude [N] of the forces that cancel within the normal forces at the last evaluated state.
    void add_cancelling_normal_forces(VectorXd& out) const;
    /// Resets stored searches, so that the bits of a solve do not depend on earlier ones.
    void forget() const {
        if (bodies_) bodies_->forget();
    }

    /// The contact between bodies, for results; nullptr if there is none.
    const BodyContactTerm* bodies() const { return bodies_; }

  private:
    ContactTerm* obstacles_ = nullptr;
    BodyContactTerm* bodies_ = nullptr;
    std::vector<ForceTerm*> frictions_;
};

}  // namespace magshell
