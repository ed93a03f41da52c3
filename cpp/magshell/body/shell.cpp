#include "magshell/body/shell.h"

#include "magshell/strain/dihedral_angle.h"

namespace magshell {

Index Shell::add_dihedral(const Nodes& at, const std::array<Index, 4>& nodes, bool right_is_point) {
    const std::vector<Vec3>& rest = at.rest;
    const DihedralAngle dihedral(broadcast(rest[nodes[0]]), broadcast(rest[nodes[1]]),
                                 broadcast(rest[nodes[2]]), broadcast(rest[nodes[3]]),
                                 SimdDouble(right_is_point ? 1.0 : 0.0));
    dihedrals.push_back({nodes, right_is_point, dihedral.angle()[0], {}, {}});
    return static_cast<Index>(dihedrals.size()) - 1;
}

void Shell::add_dihedrals(const TriangleMesh& mesh, const std::vector<DirectedEdge>& directed, bool directors,
                          Nodes& nodes) {
    first_rotation = nodes.scalars;
    for (const Index f : faces.user)
        edges.push_back({mesh.face_edges()(f, 0), mesh.face_edges()(f, 1), mesh.face_edges()(f, 2)});
    std::vector<Index> direction_of(mesh.n_edges(), -1), dihedral_of(mesh.n_edges(), -1);
    for (const DirectedEdge& d : directed) direction_of[d.edge] = d.direction;
    rotation_of_edge.assign(mesh.n_edges(), -1);
    sides.resize(n_faces());

    for (Index f = 0; f < n_faces(); ++f)
        for (int i = 0; i < 3; ++i) {
            const Index e = edges[f][i], user_face = faces.user[f];
            FaceSide& side = sides[f][i];
            const Index from = corners[f][(i + 1) % 3], to = corners[f][(i + 2) % 3], tip = corners[f][i];
            const bool forward = mesh.edge_faces()(e, 0) == user_face;
            if (direction_of[e] >= 0) {
                side.dihedral =
                    add_dihedral(nodes, {from, to, tip, nodes.direction_node(direction_of[e])}, false);
                side.weight = static_cast<float>(dihedrals[side.dihedral].weight());
                dihedrals[side.dihedral].left = {f, i};
                continue;
            }
            if (directors) {
                if (rotation_of_edge[e] < 0) {
                    rotation_of_edge[e] = nodes.scalars++;
                    edge_of_rotation.push_back(e);
                }
                side.rotation = rotation_of_edge[e];
                side.sign = forward ? 1 : -1;
            }
            if (mesh.is_boundary(e)) continue;
            side.on_left = forward;
            if (dihedral_of[e] < 0) {
                const Index other = faces.core[mesh.edge_faces()(e, forward ? 1 : 0)];
                int across = 0;
                while (edges[other][across] != e) ++across;
                const Index beyond = corners[other][across];
                dihedral_of[e] = forward ? add_dihedral(nodes, {from, to, tip, beyond}, true)
                                         : add_dihedral(nodes, {to, from, beyond, tip}, true);
            }
            side.dihedral = dihedral_of[e];
            side.weight = static_cast<float>(dihedrals[side.dihedral].weight());
            (forward ? dihedrals[side.dihedral].left : dihedrals[side.dihedral].right) = {f, i};
        }
    add_stencils();
}

void Shell::add_stencils() {
    stencils.resize(n_faces());
    for (Index f = 0; f < n_faces(); ++f)
        for (int i = 0; i < 3; ++i) {
            const FaceSide& side = sides[f][i];
            stencils[f].nodes[i] = corners[f][i];
            if (side.dihedral >= 0)
                stencils[f].nodes[3 + i] = dihedrals[side.dihedral].nodes[side.on_left ? 3 : 2];
            stencils[f].rotations[i] = side.rotation;
        }
}

void Shell::set_rotation_points(std::vector<Vec3>& points, Index first_scalar) const {
    for (Index f = 0; f < n_faces(); ++f) {
        const std::array<Vec3, 3>& at = rest_corners(f);
        for (int i = 0; i < 3; ++i) {
            const Index rotation = sides[f][i].rotation;
            if (rotation >= 0) points[first_scalar + rotation] = 0.5 * (at[(i + 1) % 3] + at[(i + 2) % 3]);
        }
    }
}

}  // namespace magshell
