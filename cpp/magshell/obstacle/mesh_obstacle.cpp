#include "magshell/obstacle/mesh_obstacle.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <string>

#include "magshell/core/errors.h"
#include "magshell/core/parallel.h"
#include "magshell/obstacle/obstacle.h"
#include "magshell/obstacle/spline_grid.h"
#include "magshell/obstacle/triangle_tree.h"

namespace magshell {
namespace {

constexpr Index margin = 4;  // [cells] margin of the grid around the mesh

Vec3 lowest(const TriangleMesh& mesh) {
    return mesh.rest_positions().colwise().minCoeff().transpose();
}

Vec3 highest(const TriangleMesh& mesh) {
    return mesh.rest_positions().colwise().maxCoeff().transpose();
}

std::vector<double> sample(const TriangleMesh& mesh, const Vec3& origin, double cell,
                           const std::array<Index, 3>& n) {
    const TriangleTree tree(mesh);
    std::vector<double> values(static_cast<std::size_t>(n[0]) * n[1] * n[2]);
    parallel_for(n[0], [&](int i) {
        for (Index j = 0; j < n[1]; ++j) {
            double* line = values.data() + (static_cast<std::size_t>(i) * n[1] + j) * n[2];
            double bound = std::numeric_limits<double>::infinity();
            for (Index k = 0; k < n[2]; ++k) {
                line[k] = tree.signed_distance(origin + cell * Vec3(i, j, k), bound);
                bound = 1.0001 *
                        // bound for the next sample: a distance changes at most by the displacement
                        (std::abs(line[k]) + cell);
            }
        }
    });
    return values;
}

// Throws InvalidInput unless the border of the grid has positive distances, which it has if the normals of the
// mesh point outwards.
void check_outside(const std::vector<double>& values, const std::array<Index, 3>& n) {
    for (Index i = 0; i < n[0]; ++i)
        for (Index j = 0; j < n[1]; ++j)
            for (Index k = 0; k < n[2]; ++k) {
                const bool border =
                    i == 0 || j == 0 || k == 0 || i == n[0] - 1 || j == n[1] - 1 || k == n[2] - 1;
                if (border && !(values[(static_cast<std::size_t>(i) * n[1] + j) * n[2] + k] > 0.0))
                    throw InvalidInput("the mesh is inside out: space outside it counts as inside");
            }
}

}  // namespace

MeshObstacle::MeshObstacle(const TriangleMesh& mesh, Index resolution)
    : middle_(0.5 * (lowest(mesh) + highest(mesh))), bounds_(0.5 * (highest(mesh) - lowest(mesh)), 0.0) {
    for (Index e = 0; e < mesh.n_edges(); ++e)
        if (mesh.is_boundary(e))
            throw InvalidInput("the mesh is open: edge " + std::to_string(e) + " has one face");
    if (resolution < 1)
        throw InvalidInput("a grid needs at least one cell, got " + std::to_string(resolution));
    const Vec3 extent = highest(mesh) - lowest(mesh);
    cell_ = extent.maxCoeff() / resolution;
    for (int a = 0; a < 3; ++a)
        samples_[a] = static_cast<Index>(std::ceil(extent[a] / cell_ - 1e-9)) + 1 + 2 * margin;
    origin_ = middle_ - 0.5 * cell_ * (Vec3(samples_[0], samples_[1], samples_[2]).array() - 1.0).matrix();
    const std::vector<double> values = sample(mesh, origin_, cell_, samples_);
    check_outside(values, samples_);
    coefficients_ = grid_coefficients(values, samples_);
}

bool MeshObstacle::contains(const Vec3& point) const {
    for (int a = 0; a < 3; ++a) {
        const double u = (point[a] - origin_[a]) / cell_;
        if (!(u >= 0.0 && u <= samples_[a] - 1.0)) return false;
    }
    return true;
}

MeshObstacle::Level MeshObstacle::level(const Vec3& point) const {
    std::array<SplineWeights, 3> w;
    std::array<std::ptrdiff_t, 3> first;
    for (int a = 0; a < 3; ++a) {
        const double u = (point[a] - origin_[a]) / cell_;
        const double i = std::clamp(std::floor(u), 0.0, samples_[a] - 2.0);
        w[a] = spline_weights(u - i);
        first[a] = static_cast<std::ptrdiff_t>(i);
    }
    const std::ptrdiff_t row = samples_[2] + 2, slab = row * (samples_[1] + 2);
    const double* corner = coefficients_.data() + first[0] * slab + first[1] * row + first[2];

    // Sums over x and y, differentiated a and b times, of the four coefficients along z.
    const Vec4 zero = Vec4::Zero();
    Vec4 sums[3][3] = {{zero, zero, zero}, {zero, zero, zero}, {zero, zero, zero}};
    for (int i = 0; i < 4; ++i) {
        Vec4 along[3] = {zero, zero, zero};
        for (int j = 0; j < 4; ++j) {
            const Vec4 line = Eigen::Map<const Vec4>(corner + i * slab + j * row);
            for (int b = 0; b < 3; ++b) along[b] += w[1][b][j] * line;
        }
        for (int a = 0; a < 3; ++a)
            for (int b = 0; a + b < 3; ++b) sums[a][b] += w[0][a][i] * along[b];
    }
    const auto derivative = [&](int a, int b, int c) {
        const Vec4 weights(w[2][c][0], w[2][c][1], w[2][c][2], w[2][c][3]);
        return weights.dot(sums[a][b]);
    };
    const double p = 1.0 / cell_;
    Level result;
    result.value = derivative(0, 0, 0);
    result.gradient = p * Vec3(derivative(1, 0, 0), derivative(0, 1, 0), derivative(0, 0, 1));
    const double xy = derivative(1, 1, 0), xz = derivative(1, 0, 1), yz = derivative(0, 1, 1);
    result.second << derivative(2, 0, 0), xy, xz, xy, derivative(0, 2, 0), yz, xz, yz, derivative(0, 0, 2);
    result.second *= p * p;
    return result;
}

// Newton's method for the saddle point of |p - x|^2 / 2 + m phi(p): p - x + m dphi = 0 and phi = 0.
bool MeshObstacle::nearest(const Vec3& point, const Level& start, Distance& out) const {
    constexpr int most = 12;
    constexpr double close = 1e-8;    // [cells]; the next step is far below round-off
    constexpr double flattest = 0.2;  // smallest |dphi| accepted [-]; it is about one near the surface
    Level at = start;
    Vec3 p = point;
    double m = start.value / start.gradient.squaredNorm();
    for (int iteration = 0; iteration < most; ++iteration) {
        const Mat3 matrix = Mat3::Identity() + m * at.second;
        if (!(std::abs(matrix.determinant()) > 1e-6)) return false;
        const Mat3 inverse = matrix.inverse();
        const Vec3 across = inverse * at.gradient, residual = inverse * (p - point + m * at.gradient);
        const double change = (at.value - at.gradient.dot(residual)) / at.gradient.dot(across);
        const Vec3 step = -residual - change * across;
        p += step;
        m += change;
        if (!contains(p)) return false;
        at = level(p);
        if (!(at.gradient.squaredNorm() > flattest * flattest)) return false;
        if (step.squaredNorm() > close * close * cell_ * cell_) continue;
        // A stationary point other than the nearest one would be farther than phi(x), which is nearly the
        // distance, by more than the error of phi.
        const double value = m * at.gradient.norm();
        if (std::abs(value - start.value) > 0.5 * cell_) return false;
        out = parallel_surface(value, at.gradient, at.second);
        return true;
    }
    return false;
}

Distance MeshObstacle::distance(const Vec3& point) const {
    if (!contains(point)) return bounds_.distance(point - middle_);
    const Level at = level(point);
    const double slope = at.gradient.norm();
    if (!(slope > on_the_center)) return {at.value, Vec3::UnitZ(), Mat3::Zero()};
    Distance result;
    if (nearest(point, at, result)) return result;
    const Vec3 normal = at.gradient / slope;
    const Mat3 tangential = Mat3::Identity() - normal * normal.transpose();
    return {at.value, normal, tangential * at.second * tangential / slope};
}

}  // namespace magshell
