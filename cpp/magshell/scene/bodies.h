// The bodies of a scene, in the numbering of the core.
#pragma once

#include <memory>
#include <vector>

#include "magshell/body/fibres.h"
#include "magshell/body/shell.h"
#include "magshell/body/six_node_shell.h"
#include "magshell/body/solid.h"

namespace magshell {

struct RigidInput;
struct SceneInput;

class Bodies {
  public:
    explicit Bodies(const SceneInput& input);

    const Nodes& nodes() const { return nodes_; }
    const std::vector<const Shell*>& shells() const { return shells_; }
    const std::vector<const Solid*>& solids() const { return solids_; }
    const std::vector<const SixNodeShell*>& six_node_shells() const { return six_node_shells_; }
    /// The index in all() of each six-node shell.
    const std::vector<Index>& six_node_bodies() const { return six_node_bodies_; }
    /// Shells, then solids, then the surfaces of solids on which something acts, then skins, then six-node shells, then the surfaces of
    /// those on which something acts, then the fibres of muscles.
    const std::vector<const Body*>& all() const { return all_; }
    /// The triangles of a body, and the index in all() of the body that has their blocks: for shells, for solids (null if nothing acts on
    /// them), for skins, and for six-node shells (as for solids).
    struct Faces {
        const Surface* surface = nullptr;
        Index body = -1;
    };
    const std::vector<Faces>& faces() const { return faces_; }
    /// The fibres of a muscle, and the index in all() of the body that has their blocks.
    struct OfMuscle {
        const Fibres* fibres;
        Index body;
    };
    const std::vector<OfMuscle>& fibres() const { return fibres_; }
    /// The nodes of each rigid body; its own points come first.
    const std::vector<std::vector<Index>>& rigid_nodes() const { return rigid_nodes_; }
    /// Returns the number of a rigid body's own points: ten, and the vertices of its surface.
    Index n_own(std::size_t part) const { return static_cast<Index>(rigid_points_[part].rows()); }
    /// Returns half the edge of the cube around the tetrahedron of the smallest rigid body [m]; infinite without rigid bodies.
    double rigid_length() const;
    /// Returns the number of vertices of shells and solids; the points of rigid bodies follow.
    Index n_body_vertices() const { return n_body_vertices_; }
    /// Returns the number of edges of all shells, one after another, in the numbering of the caller.
    Index n_edges() const { return n_edges_; }
    /// Returns the dofs that each element of a shell couples, and those of each edge moment.
    std::vector<Stencil> stencils(const SceneInput& input) const;
    /// Returns the four corners of rigid bodies; of a negative number negative nodes.
    std::vector<std::array<Index, 4>> corners_of(const std::vector<Index>& rigid) const;

    /// Returns the dofs that each element of a solid or six-node shell couples, the corners of rigid bodies coupled by a joint, and the
    /// other nodes that volumes and tendons couple.
    std::vector<Clique> cliques() const;

    VectorXd rest_state() const;
    /// Returns all dofs from positions (n_v, 3) and edge rotations (n_e,) in the numbering of the caller; the points of rigid bodies are at
    /// rest.
    VectorXd state(const Rows3& positions, const VectorXd& edge_rotations) const;
    /// Returns vectors at the caller's vertices as a vector of all dofs, zero elsewhere; of welded vertices the first one counts. The rows
    /// are the vertices of bodies, or also the points of rigid bodies.
    VectorXd vectors(const Rows3& of_vertices) const;
    /// Returns the gradient with respect to all dofs from that with respect to the caller's positions and edge rotations: the transpose of
    /// positions(), or of points().
    VectorXd gradient_by_state(const Rows3& by_positions, const VectorXd& by_edge_rotations) const;
    /// Return the positions of the bodies' vertices; and of the points of rigid bodies, too.
    Rows3 positions(const VectorXd& q) const { return rows(q, n_body_vertices_); }
    Rows3 points(const VectorXd& q) const { return rows(q, nodes_.n_user_vertices()); }
    /// Returns the gradient with respect to the caller's positions from that with respect to all dofs: the transpose of vectors().
    Rows3 gradient_by_vectors(const VectorXd& by_q) const;
    VectorXd edge_rotations(const VectorXd& q) const;
    /// Returns a number per vertex, including points of rigid bodies, as a number per dof, zero for all others. The numbers of welded
    /// vertices are added.
    VectorXd vertex_weights(const VectorXd& by_vertex) const;

    /// Returns the rest position of each dof [m]: that of its vertex, or the middle of its edge.
    std::vector<Vec3> dof_points() const;
    /// Returns twice the largest distance of a node from the center of its body at rest [m], which rotations keep.
    double extent() const;
    /// Returns the largest coordinate at rest [m].
    double reach() const;
    /// Returns the area at each dof of a vertex, zero for all others [m2]; for a solid, volume over the cube root of the total volume.
    VectorXd area_metric() const;

  private:
    void add_rotations(const VectorXd& of_edges, VectorXd& q) const;
    Rows3 rows(const VectorXd& q, Index count) const;
    void add_surface(const Surface* surface);
    void add_rigid(const std::vector<RigidInput>& rigid, NodeNumbering& numbering);
    void add_link_couplings(const SceneInput& input);
    void add_volume_and_tendon_couplings(const SceneInput& input);
    void add_attached_couplings(const SceneInput& input);

    std::vector<std::unique_ptr<Shell>> owned_;
    std::vector<std::unique_ptr<Solid>> owned_solids_;
    std::vector<std::unique_ptr<SixNodeShell>> owned_six_node_shells_;
    std::vector<std::unique_ptr<Surface>> owned_skins_;  // then the flat triangles of six-node shells
    std::vector<std::unique_ptr<SurfaceBody>> owned_surfaces_;
    std::vector<std::unique_ptr<Fibres>> owned_fibres_;
    std::vector<const Shell*> shells_;
    std::vector<const Solid*> solids_;
    std::vector<const SixNodeShell*> six_node_shells_;
    std::vector<Index> six_node_bodies_;
    std::vector<const Body*> all_;
    std::vector<Faces> faces_;
    std::vector<OfMuscle> fibres_;
    Nodes nodes_;
    std::vector<Index> copies_;  // vertices of the caller that are welded to an earlier one
    Index n_edges_ = 0, n_body_vertices_ = 0;
    std::vector<std::vector<Index>> rigid_nodes_;
    std::vector<Rows3> rigid_points_;
    std::vector<std::vector<Index>> coupled_;
};

}  // namespace magshell
