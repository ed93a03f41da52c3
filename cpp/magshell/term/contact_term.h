// Contact with obstacles: penalty energies of points of the sheet, its vertices and, if wanted, points on its faces.
//
//   E = k_n S(offset - distance(x)),   x = sum w_i x_i                    [J]    energy/contact.h
#pragma once

#include <memory>
#include <vector>

#include "magshell/assembly/lanes.h"
#include "magshell/body/nodes.h"
#include "magshell/energy/contact.h"
#include "magshell/obstacle/obstacle_state.h"
#include "magshell/term/term.h"

namespace magshell {

/// A point that obstacles keep out: a vertex, or a weighted sum of the corners of a face.
struct ContactPoint {
    std::array<Index, 3> nodes{-1, -1, -1};
    Vec3 weights = Vec3::UnitX();
};

/// What touches what. Points on faces come after vertices.
struct ContactInput {
    std::vector<Index> obstacles;
    std::vector<ContactPoint> points;  // with the caller's vertices
    bool has_friction = false,
         lagged = false;  // whether there is friction, and whether with the normal force of before
};

/// A 3x3 block of a matrix in every lane.
Pack33 to_pack(const Mat3& block);

class ContactTerm final : public Term {
  public:
    /// A point that touches an obstacle.
    struct ActiveContact {
        Index contact, obstacle, point;
        Vec3 position;
        Distance at;
        double force, stiffness;  // N [N] and dN/d(depth) [N/m]
        double by_smoothing;      // dN/d(smoothing) [N/m]
    };

    ContactTerm(const Nodes& nodes, const SystemMatrix& matrix, const std::vector<ContactInput>& contacts,
                const std::vector<std::shared_ptr<const Obstacle>>& obstacles, Registry& registry);

    bool set_values(const Values& values) override;
    void add_contact_stiffness(VectorXd& of_nodes) const override;

    /// A vertex that an obstacle keeps at a distance.
    struct HardContact {
        Index node, obstacle;
        double offset, friction;
    };
    /// All of them. Throws InvalidInput where points on faces touch as well.
    std::vector<HardContact> hard_contacts() const;
    /// From now on, until told otherwise, nothing touches: somebody else sees to that.
    void set_switched_off(bool off) { switched_off_ = off; }

    /// The points that touch at q, in the order of contacts, obstacles and points.
    std::vector<ActiveContact> active_contacts(const double* q, const Controls& controls) const;
    /// Those at the last evaluated state.
    const std::vector<ActiveContact>& evaluated_contacts() const { return evaluated_contacts_; }

    /// The first vertex of a point that comes out on another side of an obstacle than it went in, on its
    /// straight way from q to `end` as the obstacle sees it; -1 where none does.
    Index passes_through(const VectorXd& q, const Controls& controls, const VectorXd& end,
                         const Controls& controls_at_end) const;

    const ContactPoint& point(const ActiveContact& active) const {
        return contacts_[active.contact].points[active.point];
    }
    const ContactLaw& law(const ActiveContact& active) const { return laws_[active.contact]; }
    ObstacleState obstacle_state(Index obstacle, const Controls& controls) const;
    /// Adds the gradient of a function of a point's normal force and friction: by what the force is made
    /// from, by friction's own numbers and by the place of the obstacle; by its pose to `by_controls`, those that
    /// it stood at.
    void add_vjp(const ActiveContact& active, double by_force, const ContactLaw& by_friction,
                 const ObstacleGradient& by_obstacle, VectorXd& by_values, Controls& by_controls) const;

    /// Adds a symmetric block between the nodes of a point, weighted.
    void add_block(const ActiveContact& active, const Mat3& block, SystemMatrix& out) const;
    /// The weighted sum over a point's nodes of a vector of all unknowns.
    Vec3 at_point(const ActiveContact& active, const double* all) const;
    /// Adds a vector to a point's nodes, weighted.
    void distribute(const ActiveContact& active, const Vec3& vector, VectorXd& out) const;
    void distribute(const ActiveContact& active, const Vec3& force, Residual& out) const;
    /// Adds the magnitude of forces that cancel inside one that depends on the point's place by a stiffness [N/m].
    void add_cancelling_force(const ActiveContact& active, double stiffness, VectorXd& out) const;
    /// Those inside the normal forces at the last evaluated state.
    void add_cancelling_normal_forces(VectorXd& out) const;

    std::string_view name() const override { return "contact"; }
    bool depends_on_loads() const override { return false; }
    double energy(const double* q, const Controls& controls) const override;
    void evaluate(const double* q, const Controls& controls, Residual& out) override;
    void finish_assembly(const double* q, const Controls& controls, SystemMatrix& out) const override;
    void vjp(const double* q, const Controls& controls, const double* lambda, Gradient& out) override;
    std::size_t bytes() const override;

  private:
    struct Contact {
        std::vector<Index> obstacles;
        std::vector<ContactPoint> points;  // with our nodes
        std::vector<PairSlots<3>>
            slots;  // of the points with several nodes, from the first on: they come last
        Index first_on_face = 0;
        Slot stiffness, smoothing, offset, friction, sticking_speed;
    };
    struct ObstacleSlots {
        Slot center, rotation;
        Slot pose;  // a control
    };

    std::vector<Contact> contacts_;
    std::vector<ContactLaw> laws_;
    std::vector<PositionedObstacle> obstacles_;
    std::vector<ObstacleSlots> obstacle_slots_;
    std::vector<ActiveContact> evaluated_contacts_;
    bool switched_off_ = false;
};

}  // namespace magshell
