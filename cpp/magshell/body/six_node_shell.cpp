#include "magshell/body/six_node_shell.h"

#include <algorithm>
#include <utility>

#include "magshell/body/width.h"
#include "magshell/mesh/space_filling_order.h"
#include "magshell/strain/dihedral_angle_six.h"

namespace magshell {
namespace {

std::array<double, 2> angles_at_rest(const Nodes& at, const std::array<Index, 9>& nodes, bool right_is_face) {
    SimdVec3 x[9];
    for (int a = 0; a < 9; ++a) x[a] = broadcast(nodes[a] < 0 ? Vec3::Zero() : at.rest[nodes[a]]);
    const SimdDouble face(right_is_face ? 1.0 : 0.0);
    return {DihedralAngleSix(x, face, 0).angle()[0], DihedralAngleSix(x, face, 1).angle()[0]};
}

}  // namespace

SixNodeShell::SixNodeShell(std::string owner_, const SixNodeInput& input, NodeNumbering& numbering)
    : owner(std::move(owner_)) {
    const Index count = static_cast<Index>(input.faces.size());
    const auto place = [&](Index face, int k) -> Vec3 {
        return input.rest_positions.row(input.faces[face][k]).transpose();
    };
    std::vector<Vec3> barycenters(count);
    for (Index f = 0; f < count; ++f) barycenters[f] = (place(f, 0) + place(f, 1) + place(f, 2)) / 3.0;
    faces = order_along_curve(barycenters);
    own_nodes.resize(count);
    rest.resize(count);
    for (Index f = 0; f < count; ++f)
        for (int k = 0; k < 6; ++k) {
            const Index user = faces.user[f];
            rest[f][k] = place(user, k);
            own_nodes[f][k] = numbering.number(input.vertices[input.faces[user][k]], rest[f][k]);
        }
}

void SixNodeShell::add_dihedrals(const SixNodeInput& input, const std::vector<DirectedEdge>& directed,
                                 Nodes& nodes) {
    using six_nodes::middle;
    const TriangleMesh& mesh = *input.corners;
    first_rotation = nodes.scalars;
    std::vector<Index> direction_of(mesh.n_edges(), -1), dihedral_of(mesh.n_edges(), -1);
    for (const DirectedEdge& d : directed) direction_of[d.edge] = d.direction;
    rotation_of.assign(2 * static_cast<std::size_t>(mesh.n_edges()), -1);
    sides.resize(n_faces());
    const auto add = [&](const std::array<Index, 9>& of, bool right_is_face) {
        dihedrals.push_back({of, right_is_face, angles_at_rest(nodes, of, right_is_face), {}, {}});
        return static_cast<Index>(dihedrals.size()) - 1;
    };
    for (Index f = 0; f < n_faces(); ++f)
        for (int i = 0; i < 3; ++i) {
            const Index user = faces.user[f], e = mesh.face_edges()(user, i);
            FaceSideSix& side = sides[f][i];
            const bool forward = mesh.edge_faces()(e, 0) == user;
            const std::array<Index, 6>& own = own_nodes[f];
            const int from = (i + 1) % 3, to = (i + 2) % 3;
            // Nodes as in strain/dihedral_angle_six.h: the edge, the left face, then the direction in place of the right face.
            if (direction_of[e] >= 0) {
                side.dihedral = add({own[from], own[to], own[middle(i)], own[i], own[middle(from)],
                                     own[middle(to)], nodes.direction_node(direction_of[e]), -1, -1},
                                    false);
                side.weight = dihedrals[side.dihedral].weight();
                dihedrals[side.dihedral].left = {f, i};
                continue;
            }
            if (rotation_of[2 * e] < 0)
                for (int g = 0; g < 2; ++g) rotation_of[2 * e + g] = nodes.scalars++;
            // Both rotations count from the lower to the higher corner, the direction in which the `forward` face runs the edge.
            for (int g = 0; g < 2; ++g) side.rotation[g] = rotation_of[2 * e + (forward ? g : 1 - g)];
            side.sign = forward ? 1.0 : -1.0;
            if (mesh.is_boundary(e)) continue;
            side.on_left = forward;
            if (dihedral_of[e] < 0) {
                const Index left = faces.core[mesh.edge_faces()(e, 0)],
                            right = faces.core[mesh.edge_faces()(e, 1)];
                const auto opposite = [&](Index face) {
                    int k = 0;
                    while (mesh.face_edges()(faces.user[face], k) != e) ++k;
                    return k;
                };
                const int l = opposite(left), r = opposite(right);
                const std::array<Index, 6>&a = own_nodes[left], &b = own_nodes[right];
                // The right face runs the edge in the other direction: its corner r + 1 is `to`.
                dihedral_of[e] =
                    add({a[(l + 1) % 3], a[(l + 2) % 3], a[middle(l)], a[l], a[middle((l + 1) % 3)],
                         a[middle((l + 2) % 3)], b[r], b[middle((r + 2) % 3)], b[middle((r + 1) % 3)]},
                        true);
            }
            side.dihedral = dihedral_of[e];
            side.weight = dihedrals[side.dihedral].weight();
            (forward ? dihedrals[side.dihedral].left : dihedrals[side.dihedral].right) = {f, i};
        }
    add_stencils();
}

// Beyond edge i the stencil has the other face's three nodes off that edge, in the order of the dihedral angle, or the direction.
void SixNodeShell::add_stencils() {
    stencils.resize(n_faces());
    for (Index f = 0; f < n_faces(); ++f) {
        Stencil& stencil = stencils[f];
        stencil.nodes.fill(-1);
        std::copy(own_nodes[f].begin(), own_nodes[f].end(), stencil.nodes.begin());
        for (int i = 0; i < 3; ++i) {
            const FaceSideSix& side = sides[f][i];
            for (int g = 0; g < 2; ++g) stencil.rotations[2 * i + g] = side.rotation[g];
            if (side.dihedral < 0) continue;
            for (int k = 0; k < 3; ++k)
                stencil.nodes[6 + 3 * i + k] = dihedrals[side.dihedral].nodes[(side.on_left ? 6 : 3) + k];
        }
    }
}

void SixNodeShell::set_rotation_points(std::vector<Vec3>& points, Index first_scalar) const {
    for (Index f = 0; f < n_faces(); ++f)
        for (int i = 0; i < 3; ++i)
            for (const Index rotation : sides[f][i].rotation)
                if (rotation >= 0) points[first_scalar + rotation] = rest[f][six_nodes::middle(i)];
}

void SixNodeShell::add_areas(VectorXd& metric) const {
    for (Index f = 0; f < n_faces(); ++f) {
        const double area = 0.5 * (rest[f][1] - rest[f][0]).cross(rest[f][2] - rest[f][0]).norm();
        for (const Index node : own_nodes[f]) metric.segment<3>(3 * node).array() += area / 6.0;
    }
}

double SixNodeShell::extent() const {
    WeightedCenter center;
    for (const std::array<Vec3, 6>& x : rest)
        center.add((x[1] - x[0]).cross(x[2] - x[0]).norm(), (x[0] + x[1] + x[2]) / 3.0);
    return width_about(center.mean(), rest);
}

double SixNodeShell::largest_coordinate(Index face) const {
    double largest = 0.0;
    for (const Vec3& node : rest[face]) largest = std::max(largest, node.lpNorm<Eigen::Infinity>());
    return largest;
}

double SixNodeShell::smallest_height(Index face) const {
    const Vec3 &a = rest[face][0], &b = rest[face][1], &c = rest[face][2];
    const double longest =
        std::sqrt(std::max({(b - a).squaredNorm(), (c - b).squaredNorm(), (a - c).squaredNorm()}));
    return (b - a).cross(c - a).norm() / longest;
}

}  // namespace magshell
