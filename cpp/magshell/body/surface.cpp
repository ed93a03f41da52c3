#include "magshell/body/surface.h"

#include <algorithm>
#include <cmath>
#include <utility>

#include "magshell/body/width.h"
#include "magshell/mesh/space_filling_order.h"

namespace magshell {

Surface::Surface(std::string owner_, const TriangleMesh& mesh, const std::vector<Index>& vertices,
                 NodeNumbering& numbering)
    : owner(std::move(owner_)) {
    const auto place = [&](Index face, int k) -> Vec3 {
        return mesh.rest_positions().row(mesh.faces()(face, k)).transpose();
    };
    std::vector<Vec3> barycenters(mesh.n_faces());
    for (Index f = 0; f < mesh.n_faces(); ++f) {
        barycenters[f].setZero();
        for (int k = 0; k < 3; ++k) barycenters[f] += place(f, k) / 3.0;
    }
    faces = order_along_curve(barycenters);
    corners.resize(n_faces());
    rest_corners_.resize(n_faces());
    for (Index f = 0; f < n_faces(); ++f)
        for (int k = 0; k < 3; ++k) {
            const Index user = faces.user[f];
            rest_corners_[f][k] = place(user, k);
            corners[f][k] = numbering.number(vertices[mesh.faces()(user, k)], rest_corners_[f][k]);
        }
}

double Surface::largest_coordinate(Index face) const {
    double largest = 0.0;
    for (const Vec3& corner : rest_corners_[face])
        largest = std::max(largest, corner.lpNorm<Eigen::Infinity>());
    return largest;
}

double Surface::smallest_height(Index face) const {
    const auto& [a, b, c] = rest_corners_[face];
    const double longest =
        std::sqrt(std::max({(b - a).squaredNorm(), (c - b).squaredNorm(), (a - c).squaredNorm()}));
    return (b - a).cross(c - a).norm() / longest;
}

double Surface::extent() const {
    WeightedCenter center;
    for (const auto& [a, b, c] : rest_corners_) center.add((b - a).cross(c - a).norm(), (a + b + c) / 3.0);
    return width_about(center.mean(), rest_corners_);
}

}  // namespace magshell
