#include "magshell/assembly/sheet.h"

#include <algorithm>
#include <cmath>

#include "magshell/assembly/lanes.h"
#include "magshell/strain/fold_angle.h"

namespace magshell {
Sheet::Sheet(const TriangleMesh& mesh, const std::vector<DirectedEdge>& directed, const Rows3& directions,
             bool directors) {
    number(mesh);
    for (Index d = 0; d < directions.rows(); ++d) rest.push_back(directions.row(d).transpose());
    add_folds(mesh, directed, directors);
    add_stencils();
}

void Sheet::number(const TriangleMesh& mesh) {
    const Rows3& x = mesh.rest_positions();
    std::vector<Vec3> barycentres(mesh.n_faces());
    for (Index f = 0; f < mesh.n_faces(); ++f) {
        barycentres[f].setZero();
        for (int k = 0; k < 3; ++k) barycentres[f] += x.row(mesh.faces()(f, k)).transpose() / 3.0;
    }
    faces = order_along_curve(barycentres);

    std::vector<Index> order;
    std::vector<bool> seen(mesh.n_vertices(), false);
    for (const Index f : faces.user)
        for (int k = 0; k < 3; ++k) {
            const Index v = mesh.faces()(f, k);
            if (!seen[v]) order.push_back(v);
            seen[v] = true;
        }
    vertices = Renumbering::from_user_order(std::move(order));
    for (const Index v : vertices.user) rest.push_back(x.row(v).transpose());
    for (const Index f : faces.user) {
        corners.push_back({vertices.core[mesh.faces()(f, 0)], vertices.core[mesh.faces()(f, 1)],
                           vertices.core[mesh.faces()(f, 2)]});
        edges.push_back({mesh.face_edges()(f, 0), mesh.face_edges()(f, 1), mesh.face_edges()(f, 2)});
    }
}

Index Sheet::add_fold(const std::array<Index, 4>& nodes, bool right_is_point) {
    const Fold fold(broadcast(rest[nodes[0]]), broadcast(rest[nodes[1]]), broadcast(rest[nodes[2]]),
                    broadcast(rest[nodes[3]]), Pack(right_is_point ? 1.0 : 0.0));
    folds.push_back({nodes, right_is_point, fold.angle()[0], {}, {}});
    return static_cast<Index>(folds.size()) - 1;
}

void Sheet::add_folds(const TriangleMesh& mesh, const std::vector<DirectedEdge>& directed, bool directors) {
    std::vector<Index> direction_of(mesh.n_edges(), -1), fold_of(mesh.n_edges(), -1);
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
                side.fold = add_fold({from, to, tip, direction_node(direction_of[e])}, false);
                side.weight = static_cast<float>(folds[side.fold].weight());
                folds[side.fold].left = {f, i};
                continue;
            }
            if (directors) {
                if (rotation_of_edge[e] < 0) {
                    rotation_of_edge[e] = n_rotations();
                    edge_of_rotation.push_back(e);
                }
                side.rotation = rotation_of_edge[e];
                side.sign = forward ? 1 : -1;
            }
            if (mesh.is_boundary(e)) continue;
            side.on_left = forward;
            if (fold_of[e] < 0) {
                const Index other = faces.core[mesh.edge_faces()(e, forward ? 1 : 0)];
                int across = 0;
                while (edges[other][across] != e) ++across;
                const Index beyond = corners[other][across];
                fold_of[e] = forward ? add_fold({from, to, tip, beyond}, true)
                                     : add_fold({to, from, beyond, tip}, true);
            }
            side.fold = fold_of[e];
            side.weight = static_cast<float>(folds[side.fold].weight());
            (forward ? folds[side.fold].left : folds[side.fold].right) = {f, i};
        }
}

void Sheet::add_stencils() {
    stencils.resize(n_faces());
    for (Index f = 0; f < n_faces(); ++f)
        for (int i = 0; i < 3; ++i) {
            const FaceSide& side = sides[f][i];
            stencils[f].nodes[i] = corners[f][i];
            if (side.fold >= 0) stencils[f].nodes[3 + i] = folds[side.fold].nodes[side.on_left ? 3 : 2];
            stencils[f].rotations[i] = side.rotation;
        }
}

double Sheet::largest_coordinate(Index face) const {
    double largest = 0.0;
    for (const Index corner : corners[face])
        largest = std::max(largest, rest[corner].lpNorm<Eigen::Infinity>());
    return largest;
}

double Sheet::smallest_height(Index face) const {
    const Vec3 &a = rest[corners[face][0]], &b = rest[corners[face][1]], &c = rest[corners[face][2]];
    const double longest =
        std::sqrt(std::max({(b - a).squaredNorm(), (c - b).squaredNorm(), (a - c).squaredNorm()}));
    return (b - a).cross(c - a).norm() / longest;
}

std::vector<Vec3> Sheet::unknown_points() const {
    std::vector<Vec3> points(n_unknowns());
    for (Index node = 0; node < n_nodes(); ++node) std::fill_n(points.begin() + 3 * node, 3, rest[node]);
    for (Index f = 0; f < n_faces(); ++f) {
        const std::array<Vec3, 3> at = rest_corners(f);
        for (int i = 0; i < 3; ++i) {
            const Index rotation = sides[f][i].rotation;
            if (rotation >= 0) points[3 * n_nodes() + rotation] = 0.5 * (at[(i + 1) % 3] + at[(i + 2) % 3]);
        }
    }
    return points;
}

}  // namespace magshell
