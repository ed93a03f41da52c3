// ContactTerm: contact of bodies with obstacles by penalty energies at points: the vertices and, optionally,
// sample points on faces. Smooth shapes that rigid bodies carry touch obstacles as a whole (round_motion.h).
#pragma once

#include <memory>
#include <vector>

#include "magshell/assembly/lanes.h"
#include "magshell/body/nodes.h"
#include "magshell/energy/contact.h"
#include "magshell/obstacle/obstacle_state.h"
#include "magshell/terms/contact/round_motion.h"
#include "magshell/terms/term.h"

namespace magshell {

/// A point that contact acts on: a vertex, or a weighted sum of the corners of a face.
struct ContactPoint {
    std::array<Index, 3> nodes{-1, -1, -1};
    Vec3 weights = Vec3::UnitX();
};

/// One contact: the obstacles and the points that they act on. Points on faces come after vertices. Or shapes, each with the obstacle
/// that it may touch.
struct ContactInput {
    std::vector<Index> obstacles;
    std::vector<ContactPoint> points;  // in the caller's numbering of vertices
    std::vector<RoundInput> rounds;
    bool has_friction = false,
         lagged = false;  // lagged: friction uses the normal forces of the beginning of the step
};

/// An obstacle that may not slip through faces, between the points on them that it acts on: no face may sweep over a point on the
/// obstacle's middle.
struct WatchedObstacle {
    Index obstacle = 0;
    std::vector<Vec3> middles;                // in its own frame [m]
    std::vector<std::array<Index, 3>> faces;  // in the caller's numbering of vertices
};

/// A passage through an obstacle: of a point, the first of whose nodes is given, of a face, or of a shape, a node of whose rigid body is
/// given.
struct Passage {
    std::array<Index, 3> nodes{-1, -1, -1};
    bool is_round = false;

    explicit operator bool() const { return nodes[0] >= 0; }
    std::string describe(const Nodes& nodes) const;
};

/// Returns a SIMD vector that holds the same 3x3 block in every lane.
SimdMat3 to_simd(const Mat3& block);

class ContactTerm final : public Term {
  public:
    /// A point in contact with an obstacle.
    struct ActiveContact {
        Index contact, obstacle,
            point;  // point: of the contact's points, or, beyond them, of its shapes
        Vec3 position;
        Distance at;
        double force, stiffness;                                   // N [N] and dN/d(depth) [N/m]
        double by_smoothing;                                       // dN/d(smoothing) [N/m]
        std::shared_ptr<const RelativeMotion> relative = nullptr;  // of an obstacle that a rigid body carries
        std::shared_ptr<const RoundMotion> round = nullptr;        // of a shape; `at` has its gap
    };
    /// The places of a point in contact with an attached obstacle: the nodes of the point, then the corners of the rigid body.
    static constexpr int point_nodes = 3, attached_nodes = 7;
    using AttachedNodes = std::array<Index, attached_nodes>;

    /// frames: for each obstacle the corners of the rigid body that carries it; the first is negative if none does.
    ContactTerm(const Nodes& nodes, const SystemMatrix& matrix, const std::vector<ContactInput>& contacts,
                const std::vector<std::shared_ptr<const Obstacle>>& obstacles,
                const std::vector<CornerFrame::Corners>& frames, Registry& registry);

    bool set_values(const Values& values) override;
    void add_contact_stiffness(VectorXd& of_nodes) const override;

    /// A vertex that hard contact keeps at a distance from an obstacle.
    struct HardContact {
        Index node, obstacle;
        double offset, friction;
    };
    /// Returns all vertices under hard contact. Throws InvalidInput if points on faces are in contact as well, or rigid bodies carry
    /// obstacles.
    std::vector<HardContact> hard_contacts() const;
    /// Multiplies the energy, and with it all forces, by a factor from now on; see Tableau::contact_factor().
    void set_factor(double factor);
    double factor() const { return factor_; }
    /// Switches the penalty law off while another method enforces contact.
    void set_switched_off(bool off) { switched_off_ = off; }

    /// Returns the points in contact at q, in the order of contacts, obstacles and points.
    std::vector<ActiveContact> active_contacts(const double* q, const LoadParameters& load_parameters) const;
    /// Returns true if any point is in contact at q.
    bool acts(const double* q, const LoadParameters& load_parameters) const {
        return !active_contacts(q, load_parameters).empty();
    }
    /// Returns the points in contact at the last evaluated state.
    const std::vector<ActiveContact>& evaluated_contacts() const { return evaluated_contacts_; }

    /// Watches these obstacles from now on, and no others.
    void watch(const Nodes& nodes, std::vector<WatchedObstacle> watched);

    /// Returns the first point that passes through an obstacle: on its straight path from q to `end`, in the
    /// frame of the obstacle, it enters on one side and leaves on another; or the first face that sweeps over the
    /// middle of a watched obstacle.
    Passage passes_through(const VectorXd& q, const LoadParameters& load_parameters, const VectorXd& end,
                           const LoadParameters& load_parameters_at_end) const;

    /// Returns every point of every contact in the own frame of each of its obstacles, where these stand now [m], and the corners
    /// of the faces that are watched.
    std::vector<Vec3> own_positions(const VectorXd& q, const LoadParameters& load_parameters) const;
    /// Returns the first passage as passes_through() does, on the straight way between two such places.
    Passage passes_between(const std::vector<Vec3>& before, const std::vector<Vec3>& after) const;
    /// Returns the rotation vectors of each obstacle, by its placement and by its pose [rad].
    std::vector<Vec3> rotation_vectors(const LoadParameters& load_parameters) const;

    /// Returns the point of a contact that is not of a shape.
    const ContactPoint& point(const ActiveContact& active) const {
        return contacts_[active.contact].points[active.point];
    }
    const ContactLaw& law(const ActiveContact& active) const { return laws_[active.contact]; }
    ObstacleState obstacle_state(Index obstacle, const LoadParameters& load_parameters) const;
    /// Adds the gradient with respect to an obstacle's placement and pose of a function of the distance, the normal and the relative
    /// velocity at a point, as ObstacleState::vjp does.
    static void obstacle_vjp(const ActiveContact& active, const ObstacleState& obstacle, double by_distance,
                             const Vec3& by_normal, const Vec3& by_relative_velocity, ObstacleGradient& out);
    /// Adds the gradient of a function of a point's normal force and friction, given its derivatives with respect to the
    /// normal force, the friction law and the obstacle. Gradients with respect to the obstacle's pose go to
    /// `by_load_parameters`, which belong to the time at which the obstacle had that pose.
    void add_vjp(const ActiveContact& active, double by_force, const ContactLaw& by_friction,
                 const ObstacleGradient& by_obstacle, VectorXd& by_values,
                 LoadParameters& by_load_parameters) const;

    /// Adds the gradient of a function of the contact of a shape, as add_vjp() does.
    void add_round_vjp(const ActiveContact& active, const RoundMotion& motion,
                       const RoundMotion::Slopes& slopes, const ContactLaw& by_friction,
                       const ObstacleState& obstacle, VectorXd& by_values,
                       LoadParameters& by_load_parameters) const;
    /// Returns the contact of a shape with all motions and forces on its surface, where friction acts.
    static std::shared_ptr<const ActiveContact> on_surface(const ActiveContact& active);

    /// Adds a symmetric block between the nodes of a point, weighted by their shape functions, and those of a rigid body that carries
    /// the obstacle.
    void add_block(const ActiveContact& active, const Mat3& block, SystemMatrix& out) const;
    /// Returns the nodes of a point and of the rigid body that carries its obstacle, and their Jacobians of the relative motion.
    AttachedNodes attached_nodes_of(const ActiveContact& active) const;
    Mat3 jacobian(const ActiveContact& active, int place) const;
    /// Returns the value at a point of a vector of all degrees of freedom, relative to a rigid body that carries the obstacle.
    Vec3 at_point(const ActiveContact& active, const double* all) const;
    /// Distributes a vector at a point to the point's nodes, by their weights, and its reaction to such a rigid body.
    void distribute(const ActiveContact& active, const Vec3& vector, VectorXd& out) const;
    void distribute(const ActiveContact& active, const Vec3& force, Residual& out) const;
    /// Adds the magnitude [N] of the forces that cancel within a force that depends on the point's position by
    /// a stiffness [N/m].
    void add_cancelling_force(const ActiveContact& active, double stiffness, VectorXd& out) const;
    /// Adds those within the normal forces at the last evaluated state.
    void add_cancelling_normal_forces(VectorXd& out) const;

    std::string_view name() const override { return "contact"; }
    Capabilities capabilities() const override { return {.has_stiffness_jumps = true}; }
    bool depends_on_loads() const override { return false; }
    double energy(const double* q, const LoadParameters& load_parameters) const override;
    void evaluate(const double* q, const LoadParameters& load_parameters, Residual& out) override;
    void finish_assembly(const double* q, const LoadParameters& load_parameters,
                         SystemMatrix& out) const override;
    void vjp(const double* q, const LoadParameters& load_parameters, const double* lambda,
             Gradient& out) override;
    std::size_t bytes() const override;

  private:
    /// Appends the shapes of a contact that are in contact.
    void add_active_rounds(Index contact, const double* q, const LoadParameters& load_parameters,
                           std::vector<ActiveContact>& out) const;
    /// Adds the symmetric blocks block(i, j) between the rigid bodies of a shape and of its obstacle.
    template <class Block>
    void add_round_blocks(const ActiveContact& active, const Block& block, SystemMatrix& out) const;
    /// Returns the centers of the balls within a shape of a contact [m].
    std::vector<Vec3> inner_centers(const RoundInput& round, const std::vector<InnerBall>& balls,
                                    const double* q) const;
    /// Returns a point of the world in an obstacle's own frame.
    Vec3 own_position(Index obstacle, const ObstacleState& at, const VectorXd& q, const Vec3& x) const;
    /// Calls add(node, part) for the parts of a vector at a point that its nodes take, and those of the reaction.
    template <class Add>
    void distribute_to_nodes(const ActiveContact& active, const Vec3& vector, const Add& add) const;
    /// Adds the part of the Hessian due to the rotation of a rigid body that carries the obstacle, for this normal force.
    void add_rotation_curvature(const ActiveContact& active, SystemMatrix& out) const;
    /// Adds the lower triangle of the blocks block(i, j) between the nodes of a point and the rigid body that carries its obstacle.
    template <class Block>
    void add_attached_blocks(const ActiveContact& active, const Block& block, SystemMatrix& out) const;

    struct Contact {
        std::vector<Index> obstacles;
        std::vector<ContactPoint> points;  // in the core's numbering of nodes
        std::vector<RoundInput> rounds;
        std::vector<std::vector<InnerBall>> inner;  // of each of them
        std::vector<PairSlots<RoundMotion::places>> round_slots;
        std::vector<PairSlots<3>> slots;  // for points on faces, which come last
        Index first_on_face = 0;
        ParameterSlice stiffness, smoothing, offset, friction, sticking_speed;
        std::vector<std::vector<PairSlots<attached_nodes>>>
            attached;  // per obstacle: of its points, if it is carried
    };
    struct ObstacleSlices {
        ParameterSlice center, rotation;
        ParameterSlice pose;  // a load parameter
    };

    std::vector<Contact> contacts_;
    std::vector<ContactLaw> laws_;  // with the stiffness times factor_
    double factor_ = 1.0;
    std::vector<double> stiffness_;  // [N/m] of each contact, without the factor
    std::vector<PositionedObstacle> obstacles_;
    std::vector<std::unique_ptr<const CornerFrame>> frames_;  // per obstacle; nullptr: none
    std::vector<ObstacleSlices> obstacle_slices_;
    std::vector<ActiveContact> evaluated_contacts_;
    std::vector<WatchedObstacle> watched_;  // with faces in the core's numbering of nodes
    bool switched_off_ = false;
};

}  // namespace magshell
