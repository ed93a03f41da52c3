#include "magshell/body/membrane_faces.h"

#include <algorithm>
#include <cmath>
#include <numbers>

namespace magshell {
namespace {

// [rad] Smallest angle opposite the long edge of a cap; see test_obtuse_faces_inside_a_sheet_do_not_stiffen_it.
constexpr double cap_angle = 150.0 / 180.0 * std::numbers::pi;
// [rad] Rest angle above which an edge is a fold that stays; see test_faces_at_folds_and_hinges_keep_their_own_triangles.
constexpr double flat = 0.1;
// [-] Curvature scale, over that of the neighbours, below which an edge is a hinge; see the same test.
constexpr double softer = 0.5;

double angle_at(const Vec3& corner, const Vec3& a, const Vec3& b) {
    const Vec3 u = a - corner, v = b - corner;
    return std::atan2(u.cross(v).norm(), u.dot(v));
}

double largest_angle(const Vec3& a, const Vec3& b, const Vec3& c) {
    return std::max({angle_at(a, b, c), angle_at(b, c, a), angle_at(c, a, b)});
}

// Returns by how much the largest angle of both faces falls if their quadrilateral is cut along its other diagonal [rad]; 0 if it must not be.
// Nodes of the stencil: 0 and 1 are the ends of the common edge, 2 and 3 the corners opposite it.
double gain(const std::vector<Vec3>& rest, const DihedralStencil& dihedral) {
    const auto at = [&](int k) -> const Vec3& { return rest[dihedral.nodes[k]]; };
    const double tip = std::max(angle_at(at(2), at(0), at(1)), angle_at(at(3), at(0), at(1)));
    if (tip < cap_angle) return 0.0;
    for (const int end : {0, 1})  // the other diagonal has to lie inside
        if (angle_at(at(end), at(1 - end), at(2)) + angle_at(at(end), at(1 - end), at(3)) >= std::numbers::pi)
            return 0.0;
    return tip - std::max(largest_angle(at(2), at(0), at(3)), largest_angle(at(3), at(1), at(2)));
}

bool is_hinge(const Shell& shell, const DihedralStencil& dihedral, const VectorXd& curvature_scale) {
    double largest = 0.0;
    for (const DihedralStencil::Side& side : {dihedral.left, dihedral.right})
        for (const Index edge : shell.edges[side.face]) largest = std::max(largest, curvature_scale[edge]);
    return curvature_scale[shell.edges[dihedral.left.face][dihedral.left.corner]] < softer * largest;
}

}  // namespace

MembraneFaces::MembraneFaces(const Shell& shell, const Nodes& nodes, const VectorXd& curvature_scale)
    : shell_(shell), nodes_(nodes) {
    struct Candidate {
        double gain;
        Index dihedral;
    };
    std::vector<Candidate> candidates;
    for (Index h = 0; h < static_cast<Index>(shell.dihedrals.size()); ++h) {
        const DihedralStencil& dihedral = shell.dihedrals[h];
        if (!dihedral.right_is_point || std::abs(dihedral.rest_angle) > flat) continue;
        const double better = gain(nodes.rest, dihedral);
        if (better > 0.0 && !is_hinge(shell, dihedral, curvature_scale)) candidates.push_back({better, h});
    }
    std::stable_sort(candidates.begin(), candidates.end(),
                     [](const Candidate& a, const Candidate& b) { return a.gain > b.gain; });
    for (const Candidate& candidate : candidates) exchange(shell.dihedrals[candidate.dihedral]);
}

// Exchanges the diagonal, once per face: the matrix couples the nodes across its own edges, and no others.
void MembraneFaces::exchange(const DihedralStencil& dihedral) {
    if (is_unchanged()) {
        corners_ = shell_.corners;
        for (Index f = 0; f < shell_.n_faces(); ++f) parts_.push_back(single_part(f));
    }
    const Index left = dihedral.left.face, right = dihedral.right.face;
    if (parts_[left][1].part > 0.0 || parts_[right][1].part > 0.0) return;
    const auto area = [&](Index face) {
        const std::array<Vec3, 3> x = shell_.rest_corners(face);
        return (x[1] - x[0]).cross(x[2] - x[0]).norm();
    };
    // The new diagonal cuts both faces at the same point of their common edge, so both triangles have the same fractions of material.
    const double part = area(left) / (area(left) + area(right));
    parts_[left] = parts_[right] = {FacePart{left, part}, FacePart{right, 1.0 - part}};
    const std::array<Index, 4>& n = dihedral.nodes;
    corners_[left] = {n[2], n[0], n[3]};
    corners_[right] = {n[3], n[1], n[2]};
}

std::array<Vec3, 3> MembraneFaces::rest_corners(Index face) const {
    const std::array<Index, 3>& c = corners()[face];
    return {nodes_.rest[c[0]], nodes_.rest[c[1]], nodes_.rest[c[2]]};
}

}  // namespace magshell
