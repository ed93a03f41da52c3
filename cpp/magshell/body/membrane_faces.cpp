#include "magshell/body/membrane_faces.h"

#include <algorithm>
#include <cmath>
#include <numbers>

namespace magshell {
namespace {

constexpr double cap_angle = 150.0 / 180.0 * std::numbers::pi;  // opposite the long edge, at least
constexpr double flat = 0.1;                                    // [rad] a larger angle at rest is a fold
constexpr double softer = 0.5;  // an edge with this share of its neighbours' curvature scale is a hinge

double angle_at(const Vec3& corner, const Vec3& a, const Vec3& b) {
    const Vec3 u = a - corner, v = b - corner;
    return std::atan2(u.cross(v).norm(), u.dot(v));
}

double largest_angle(const Vec3& a, const Vec3& b, const Vec3& c) {
    return std::max({angle_at(a, b, c), angle_at(b, c, a), angle_at(c, a, b)});
}

// By how much the diagonal of a fold that the cap shares is worse than the other one [rad]; 0 where it stays.
double gain(const std::vector<Vec3>& rest, const FoldStencil& fold) {
    const auto at = [&](int k) -> const Vec3& { return rest[fold.nodes[k]]; };
    const double tip = std::max(angle_at(at(2), at(0), at(1)), angle_at(at(3), at(0), at(1)));
    if (tip < cap_angle) return 0.0;
    for (const int end : {0, 1})  // the other diagonal has to lie inside
        if (angle_at(at(end), at(1 - end), at(2)) + angle_at(at(end), at(1 - end), at(3)) >= std::numbers::pi)
            return 0.0;
    return tip - std::max(largest_angle(at(2), at(0), at(3)), largest_angle(at(3), at(1), at(2)));
}

bool is_hinge(const Sheet& sheet, const FoldStencil& fold, const VectorXd& curvature_scale) {
    double largest = 0.0;
    for (const FoldStencil::Side& side : {fold.left, fold.right})
        for (const Index edge : sheet.edges[side.face]) largest = std::max(largest, curvature_scale[edge]);
    return curvature_scale[sheet.edges[fold.left.face][fold.left.corner]] < softer * largest;
}

}  // namespace

MembraneFaces::MembraneFaces(const Sheet& sheet, const Nodes& nodes, const VectorXd& curvature_scale)
    : sheet_(sheet), nodes_(nodes) {
    struct Candidate {
        double gain;
        Index fold;
    };
    std::vector<Candidate> candidates;
    for (Index h = 0; h < static_cast<Index>(sheet.folds.size()); ++h) {
        const FoldStencil& fold = sheet.folds[h];
        if (!fold.right_is_point || std::abs(fold.rest_angle) > flat) continue;
        const double better = gain(nodes.rest, fold);
        if (better > 0.0 && !is_hinge(sheet, fold, curvature_scale)) candidates.push_back({better, h});
    }
    std::stable_sort(candidates.begin(), candidates.end(),
                     [](const Candidate& a, const Candidate& b) { return a.gain > b.gain; });
    for (const Candidate& candidate : candidates) exchange(sheet.folds[candidate.fold]);
}

// Once a face: the matrix has room for the other diagonal of its own folds, and for no further ones.
void MembraneFaces::exchange(const FoldStencil& fold) {
    if (own()) {
        corners_ = sheet_.corners;
        for (Index f = 0; f < sheet_.n_faces(); ++f) shares_.push_back(whole(f));
    }
    const Index left = fold.left.face, right = fold.right.face;
    if (shares_[left][1].part > 0.0 || shares_[right][1].part > 0.0) return;
    const auto area = [&](Index face) {
        const std::array<Vec3, 3> x = sheet_.rest_corners(face);
        return (x[1] - x[0]).cross(x[2] - x[0]).norm();
    };
    // The other diagonal cuts both faces at the same point of their edge.
    const double part = area(left) / (area(left) + area(right));
    shares_[left] = shares_[right] = {Share{left, part}, Share{right, 1.0 - part}};
    const std::array<Index, 4>& n = fold.nodes;
    corners_[left] = {n[2], n[0], n[3]};
    corners_[right] = {n[3], n[1], n[2]};
}

std::array<Vec3, 3> MembraneFaces::rest_corners(Index face) const {
    const std::array<Index, 3>& c = corners()[face];
    return {nodes_.rest[c[0]], nodes_.rest[c[1]], nodes_.rest[c[2]]};
}

}  // namespace magshell
