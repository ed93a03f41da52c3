#include "magshell/scene/bodies.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "magshell/scene/scene_input.h"

namespace magshell {

Bodies::Bodies(const SceneInput& input) {
    n_body_vertices_ = input.n_vertices;
    Index n_points = input.n_vertices;
    for (const RigidInput& part : input.rigid) n_points += static_cast<Index>(part.points.rows());
    NodeNumbering numbering(n_points);
    for (const ShellInput& shell : input.shells)
        owned_.push_back(std::make_unique<Shell>(shell.owner, *shell.mesh, shell.vertices, numbering));
    for (const SolidInput& solid : input.solids)
        owned_solids_.push_back(std::make_unique<Solid>(solid.owner, solid.rest_positions, solid.elements,
                                                        solid.nodes_per_element, solid.vertices,
                                                        solid.surface, numbering));
    for (const SixNodeShellInput& shell : input.six_node_shells)
        owned_six_node_shells_.push_back(std::make_unique<SixNodeShell>(shell.owner, shell.mesh, numbering));
    for (const SkinInput& skin : input.skins)
        owned_skins_.push_back(
            std::make_unique<Surface>(skin.owner, *skin.surface.mesh, skin.surface.vertices, numbering));
    std::vector<const Surface*> flat;  // of six-node shells
    for (const SixNodeShellInput& shell : input.six_node_shells)
        flat.push_back(shell.surface_acts
                           ? owned_skins_
                                 .emplace_back(std::make_unique<Surface>(shell.owner, *shell.surface.mesh,
                                                                         shell.surface.vertices, numbering))
                                 .get()
                           : nullptr);
    const std::size_t n_skins = input.skins.size();
    add_rigid(input.rigid, numbering);
    add_link_couplings(input);
    nodes_ = numbering.finish(input.directions, input.original);
    add_volume_and_tendon_couplings(input);
    add_attached_couplings(input);
    for (const GroupEnergyInput& energy : input.group_energies)
        for (std::size_t first = 0; first < energy.vertices.size(); first += energy.group_size) {
            std::vector<Index>& nodes = coupled_.emplace_back();
            for (Index k = 0; k < energy.group_size; ++k)
                nodes.push_back(nodes_.vertices.core[energy.vertices[first + k]]);
            std::sort(nodes.begin(), nodes.end());
            nodes.erase(std::unique(nodes.begin(), nodes.end()), nodes.end());
        }
    for (const SpringsInput& springs : input.springs)
        for (const SpringsInput::Spring& spring : springs.springs)
            if (spring.vertices.size() > 1) {
                std::vector<Index>& nodes = coupled_.emplace_back();
                for (const Index vertex : spring.vertices) nodes.push_back(nodes_.vertices.core[vertex]);
                std::sort(nodes.begin(), nodes.end());
                nodes.erase(std::unique(nodes.begin(), nodes.end()), nodes.end());
            }
    for (const EdgeMomentInput& couple : input.couples) {
        if (couple.shell < static_cast<Index>(owned_.size())) continue;
        const std::size_t k = couple.shell - owned_.size();
        const Index face = input.six_node_shells[k].mesh.corners->edge_faces().row(couple.edge).maxCoeff();
        const SixNodeShell& shell = *owned_six_node_shells_[k];
        std::vector<Index>& nodes = coupled_.emplace_back();
        for (const Index node : shell.own_nodes[shell.faces.core[face]]) nodes.push_back(node);
        nodes.push_back(nodes_.direction_node(couple.direction));
    }
    for (Index user = 0; user < nodes_.n_user_vertices(); ++user)
        if (nodes_.vertices.is_copy(user)) copies_.push_back(user);
    for (std::size_t k = 0; k < owned_.size(); ++k) {
        const ShellInput& given = input.shells[k];
        owned_[k]->add_dihedrals(*given.mesh, given.directed_edges, given.directors, nodes_);
        n_edges_ += owned_[k]->n_edges();
        shells_.push_back(owned_[k].get());
        all_.push_back(owned_[k].get());
    }
    for (const std::unique_ptr<Solid>& solid : owned_solids_) {
        solids_.push_back(solid.get());
        all_.push_back(solid.get());
    }
    for (std::size_t k = 0; k < shells_.size(); ++k) faces_.push_back({shells_[k], static_cast<Index>(k)});
    for (std::size_t k = 0; k < solids_.size(); ++k)
        add_surface(input.solids[k].surface_acts ? solids_[k]->surface() : nullptr);
    for (std::size_t k = 0; k < n_skins; ++k) add_surface(owned_skins_[k].get());
    for (std::size_t k = 0; k < owned_six_node_shells_.size(); ++k) {
        const SixNodeShellInput& given = input.six_node_shells[k];
        owned_six_node_shells_[k]->add_dihedrals(given.mesh, given.directed_edges, nodes_);
        n_edges_ += owned_six_node_shells_[k]->n_edge_rotations();
        six_node_shells_.push_back(owned_six_node_shells_[k].get());
        six_node_bodies_.push_back(static_cast<Index>(all_.size()));
        all_.push_back(owned_six_node_shells_[k].get());
    }
    for (const Surface* surface : flat) add_surface(surface);
    for (const MuscleInput& muscle : input.muscles) {
        const Fibres* fibres =
            owned_fibres_.emplace_back(std::make_unique<Fibres>(*solids_[muscle.solid], muscle.elements))
                .get();
        fibres_.push_back({fibres, static_cast<Index>(all_.size())});
        all_.push_back(fibres);
    }
}

void Bodies::add_surface(const Surface* surface) {
    Faces& faces = faces_.emplace_back();
    if (!surface) return;
    faces = {surface, static_cast<Index>(all_.size())};
    all_.push_back(owned_surfaces_.emplace_back(std::make_unique<SurfaceBody>(*surface)).get());
}

void Bodies::add_rigid(const std::vector<RigidInput>& rigid, NodeNumbering& numbering) {
    // The ten points of each rigid body come first, then those of their surfaces.
    Index user = n_body_vertices_, on_surface = user + RigidInput::own * static_cast<Index>(rigid.size());
    for (const RigidInput& part : rigid) {
        std::vector<Index>& nodes = rigid_nodes_.emplace_back();
        for (Index k = 0; k < static_cast<Index>(part.points.rows()); ++k)
            nodes.push_back(numbering.number(k < RigidInput::own ? user++ : on_surface++,
                                             part.points.row(k).transpose()));
        for (const Index vertex : part.vertices) nodes.push_back(numbering.number(vertex, Vec3::Zero()));
        rigid_points_.push_back(part.points);
    }
}

void Bodies::add_link_couplings(const SceneInput& input) {
    const auto couple = [&](Index a, Index b) {
        std::vector<Index>& corners = coupled_.emplace_back();
        for (const Index part : {a, b})
            if (part >= 0)
                corners.insert(corners.end(), rigid_nodes_[part].begin(), rigid_nodes_[part].begin() + 4);
    };
    for (const SkeletonInput& skeleton : input.skeletons)
        for (std::size_t k = 0; k < skeleton.links.size(); ++k)
            if (!skeleton.owners[k].empty()) {
                const Index parent = skeleton.joints[k].parent;
                couple(parent < 0 ? -1 : skeleton.links[parent], skeleton.links[k]);
            }
    for (const ClosureInput& closure : input.closures) couple(closure.parent, closure.child);
}

void Bodies::add_volume_and_tendon_couplings(const SceneInput& input) {
    const auto add = [&](std::vector<Index>& nodes, auto first, auto last) {
        for (; first != last; ++first) nodes.push_back(nodes_.vertices.core[*first]);
    };
    const auto close = [](std::vector<Index>& nodes) {
        std::sort(nodes.begin(), nodes.end());
        nodes.erase(std::unique(nodes.begin(), nodes.end()), nodes.end());
    };
    for (const VolumeInput& volume : input.volumes)
        for (const ClosedSurface& surface : volume.surfaces) {
            const auto &flat = surface.triangles, &curved = surface.curved;
            if (volume.coupled) {
                std::vector<Index>& nodes = coupled_.emplace_back();
                add(nodes, flat.begin(), flat.end());
                add(nodes, curved.begin(), curved.end());
                close(nodes);
                continue;
            }
            // Faces of bodies are coupled by their elements; lids belong to no body.
            for (std::size_t f = 0; f + 2 < flat.size(); f += 3) {
                std::vector<Index>& nodes = coupled_.emplace_back();
                add(nodes, flat.begin() + f, flat.begin() + f + 3);
                close(nodes);
            }
        }
    for (const TendonInput& tendon : input.tendons)
        for (std::size_t k = 0; k + 1 < tendon.points.size(); ++k) {
            std::vector<Index>& nodes = coupled_.emplace_back();
            for (const EmbeddedPoint& point : {tendon.points[k], tendon.points[k + 1]})
                add(nodes, point.vertices.begin(), point.vertices.end());
            close(nodes);
        }
}

std::vector<std::array<Index, 4>> Bodies::corners_of(const std::vector<Index>& rigid) const {
    std::vector<std::array<Index, 4>> all;
    for (const Index part : rigid) {
        std::array<Index, 4>& corners = all.emplace_back();
        corners.fill(-1);
        if (part >= 0) std::copy_n(rigid_nodes_[part].begin(), 4, corners.begin());
    }
    return all;
}

// Couples every point in contact with the corners of the rigid body that carries the obstacle, and every smooth shape with its own and
// with these.
void Bodies::add_attached_couplings(const SceneInput& input) {
    const std::vector<std::array<Index, 4>> corners = corners_of(input.attached_to);
    for (const ContactInput& contact : input.contacts)
        for (const Index obstacle : contact.obstacles)
            for (const ContactPoint& point : contact.points) {
                if (corners[obstacle][0] < 0) break;
                std::vector<Index>& nodes =
                    coupled_.emplace_back(corners[obstacle].begin(), corners[obstacle].end());
                for (const Index vertex : point.nodes)
                    if (vertex >= 0) nodes.push_back(nodes_.vertices.core[vertex]);
            }
    for (const ContactInput& contact : input.contacts)
        for (const RoundInput& round : contact.rounds) {
            const std::array<Index, 4>&own = corners[round.shape], &other = corners[round.obstacle];
            std::vector<Index>& nodes = coupled_.emplace_back(own.begin(), own.end());
            if (other[0] >= 0) nodes.insert(nodes.end(), other.begin(), other.end());
        }
}

std::vector<Stencil> Bodies::stencils(const SceneInput& input) const {
    std::vector<Stencil> all;
    for (const Shell* shell : shells_) all.insert(all.end(), shell->stencils.begin(), shell->stencils.end());
    for (const EdgeMomentInput& couple : input.couples) {
        if (couple.shell >= static_cast<Index>(shells_.size())) continue;  // coupled by a clique of its own
        const Shell& shell = *shells_[couple.shell];
        const Index user_face = input.shells[couple.shell].mesh->edge_faces().row(couple.edge).maxCoeff();
        Stencil s;
        for (int k = 0; k < 3; ++k) s.nodes[k] = shell.corners[shell.faces.core[user_face]][k];
        s.nodes[3] = nodes_.direction_node(couple.direction);
        all.push_back(s);
    }
    for (std::size_t k = 0; k < input.rigid.size(); ++k)
        if (input.rigid[k].magnetic)
            std::copy_n(rigid_nodes_[k].begin(), 4, all.emplace_back().nodes.begin());
    return all;
}

std::vector<Clique> Bodies::cliques() const {
    std::vector<Clique> all;
    for (const Solid* solid : solids_)
        for (Index element = 0; element < solid->n_elements(); ++element)
            all.push_back({solid->nodes_of(element)});
    for (const SixNodeShell* shell : six_node_shells_)
        for (Index face = 0; face < shell->n_faces(); ++face)
            all.push_back({shell->nodes_of(face), shell->scalars_of(face)});
    for (const std::vector<Index>& nodes : coupled_) all.push_back({nodes});
    return all;
}

VectorXd Bodies::rest_state() const {
    VectorXd q = VectorXd::Zero(nodes_.n_dofs());
    for (Index node = 0; node < nodes_.n_nodes(); ++node) q.segment<3>(3 * node) = nodes_.rest[node];
    return q;
}

VectorXd Bodies::state(const Rows3& positions, const VectorXd& edge_rotations) const {
    VectorXd q = vectors(positions);
    add_rotations(edge_rotations, q);
    for (Index node = nodes_.n_vertices(); node < nodes_.n_nodes(); ++node)
        q.segment<3>(3 * node) = nodes_.rest[node];
    for (std::size_t part = 0; part < rigid_nodes_.size(); ++part)
        for (Index k = 0; k < n_own(part); ++k) {
            const Index node = rigid_nodes_[part][k];
            q.segment<3>(3 * node) = nodes_.rest[node];
        }
    return q;
}

VectorXd Bodies::vectors(const Rows3& of_vertices) const {
    VectorXd q = VectorXd::Zero(nodes_.n_dofs());
    for (Index v = 0; v < nodes_.n_vertices(); ++v)
        if (nodes_.user_vertex(v) < of_vertices.rows())
            q.segment<3>(3 * v) = of_vertices.row(nodes_.user_vertex(v)).transpose();
    return q;
}

Rows3 Bodies::gradient_by_vectors(const VectorXd& by_q) const {
    Rows3 by_vertices = positions(by_q);
    for (const Index copy : copies_) by_vertices.row(copy).setZero();
    return by_vertices;
}

VectorXd Bodies::gradient_by_state(const Rows3& by_positions, const VectorXd& by_edge_rotations) const {
    VectorXd gradient = vectors(by_positions);
    for (const Index copy : copies_)
        gradient.segment<3>(3 * nodes_.vertices.core[copy]) += by_positions.row(copy).transpose();
    add_rotations(by_edge_rotations, gradient);
    return gradient;
}

void Bodies::add_rotations(const VectorXd& of_edges, VectorXd& q) const {
    Index first_edge = 0;
    for (const Shell* shell : shells_) {
        for (Index r = 0; r < shell->n_rotations(); ++r)
            q[nodes_.first_scalar() + shell->first_rotation + r] =
                of_edges[first_edge + shell->edge_of_rotation[r]];
        first_edge += shell->n_edges();
    }
    for (const SixNodeShell* shell : six_node_shells_)
        for (const Index rotation : shell->rotation_of) {
            if (rotation >= 0) q[nodes_.first_scalar() + rotation] = of_edges[first_edge];
            ++first_edge;
        }
}

Rows3 Bodies::rows(const VectorXd& q, Index count) const {
    Rows3 x(count, 3);
    for (Index v = 0; v < nodes_.n_vertices(); ++v)
        if (nodes_.user_vertex(v) < count) x.row(nodes_.user_vertex(v)) = q.segment<3>(3 * v).transpose();
    for (const Index copy : copies_) x.row(copy) = q.segment<3>(3 * nodes_.vertices.core[copy]).transpose();
    return x;
}

VectorXd Bodies::edge_rotations(const VectorXd& q) const {
    VectorXd rotations = VectorXd::Zero(n_edges_);
    Index first_edge = 0;
    for (const Shell* shell : shells_) {
        for (Index r = 0; r < shell->n_rotations(); ++r)
            rotations[first_edge + shell->edge_of_rotation[r]] =
                q[nodes_.first_scalar() + shell->first_rotation + r];
        first_edge += shell->n_edges();
    }
    for (const SixNodeShell* shell : six_node_shells_)
        for (const Index rotation : shell->rotation_of) {
            if (rotation >= 0) rotations[first_edge] = q[nodes_.first_scalar() + rotation];
            ++first_edge;
        }
    return rotations;
}

VectorXd Bodies::vertex_weights(const VectorXd& by_vertex) const {
    VectorXd weights = VectorXd::Zero(nodes_.n_dofs());
    for (Index v = 0; v < nodes_.n_vertices(); ++v)
        weights.segment<3>(3 * v).setConstant(by_vertex[nodes_.user_vertex(v)]);
    for (const Index copy : copies_)
        weights.segment<3>(3 * nodes_.vertices.core[copy]).array() += by_vertex[copy];
    return weights;
}

std::vector<Vec3> Bodies::dof_points() const {
    std::vector<Vec3> points(nodes_.n_dofs());
    for (Index node = 0; node < nodes_.n_nodes(); ++node)
        std::fill_n(points.begin() + 3 * node, 3, nodes_.rest[node]);
    for (const Shell* shell : shells_) shell->set_rotation_points(points, nodes_.first_scalar());
    for (const SixNodeShell* shell : six_node_shells_)
        shell->set_rotation_points(points, nodes_.first_scalar());
    return points;
}

double Bodies::extent() const {
    double largest = 0.0;
    for (const Shell* shell : shells_) largest = std::max(largest, shell->extent());
    for (const Rows3& points : rigid_points_)
        largest =
            std::max(largest, 2.0 * (points.rowwise() - points.colwise().mean()).rowwise().norm().maxCoeff());
    for (const Solid* solid : solids_) largest = std::max(largest, solid->extent());
    for (const SixNodeShell* shell : six_node_shells_) largest = std::max(largest, shell->extent());
    return largest;
}

double Bodies::rigid_length() const {
    double smallest = std::numeric_limits<double>::infinity();
    for (const Rows3& points : rigid_points_)
        smallest = std::min(smallest, 0.5 * (points.row(0) - points.row(1)).norm() / std::sqrt(2.0));
    return smallest;
}

double Bodies::reach() const {
    double largest = 0.0;
    for (Index v = 0; v < nodes_.n_vertices(); ++v)
        largest = std::max(largest, nodes_.rest[v].lpNorm<Eigen::Infinity>());
    return largest;
}

VectorXd Bodies::area_metric() const {
    VectorXd metric = VectorXd::Zero(nodes_.n_dofs());
    for (const Shell* shell : shells_)
        for (Index f = 0; f < shell->n_faces(); ++f) {
            const auto& [a, b, c] = shell->rest_corners(f);
            for (const Index node : shell->corners[f])
                metric.segment<3>(3 * node).array() += (b - a).cross(c - a).norm() / 6.0;
        }
    for (const SixNodeShell* shell : six_node_shells_) shell->add_areas(metric);
    for (const Solid* solid : solids_) {
        VectorXd volumes = VectorXd::Zero(nodes_.n_dofs());
        solid->add_volumes(volumes);
        metric += volumes / std::cbrt(solid->volume());
    }
    // A rigid body has the area of the faces of its tetrahedron, since its motion needs a measure, too.
    for (const std::vector<Index>& part : rigid_nodes_)
        for (Index k = 0; k < 4; ++k)
            metric.segment<3>(3 * part[k]).array() +=
                0.25 * (nodes_.rest[part[0]] - nodes_.rest[part[1]]).squaredNorm();
    return metric;
}

}  // namespace magshell
