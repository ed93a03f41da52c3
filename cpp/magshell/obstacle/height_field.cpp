#include "magshell/obstacle/height_field.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <string>

#include "magshell/core/errors.h"
#include "magshell/obstacle/obstacle.h"
#include "magshell/obstacle/spline_grid.h"

namespace magshell {
namespace {

constexpr Index settled = 2;  // [knots] beyond the border until the surface is level

// The position of a coordinate on an axis: the four coefficients around it, and their weights.
struct Place {
    std::array<std::ptrdiff_t, 4> index;
    SplineWeights weights;
};

Place place_of(double knots, Index samples) {
    const double s = std::clamp<double>(knots, -settled, samples - 1.0 + settled);  // constant beyond
    const double i = std::floor(s);
    Place place;
    place.weights = spline_weights(s - i);
    for (int k = 0; k < 4; ++k)
        place.index[k] = std::clamp<std::ptrdiff_t>(static_cast<std::ptrdiff_t>(i) + k, 0, samples + 1);
    return place;
}

}  // namespace

HeightField::HeightField(const Pair& origin, const Pair& spacing, const std::array<Index, 2>& samples,
                         std::span<const double> heights)
    : origin_(origin), spacing_(spacing), samples_(samples) {
    if (samples[0] < 2 || samples[1] < 2 ||
        heights.size() != static_cast<std::size_t>(samples[0]) * static_cast<std::size_t>(samples[1])) {
        throw InvalidInput("a height field needs at least 2 x 2 heights, and " + std::to_string(samples[0]) +
                           " x " + std::to_string(samples[1]) + " do not fit " +
                           std::to_string(heights.size()) + " values");
    }
    coefficients_ = grid_coefficients(heights, samples);
    bound_derivatives();
    build_blocks();
}

// Bounds slope and curvature: derivatives of a B-spline are averages of differences of its coefficients.
void HeightField::bound_derivatives() {
    const Index nx = samples_[0] + 2, ny = samples_[1] + 2;
    const auto c = [&](Index i, Index j) { return coefficients_[static_cast<std::size_t>(i) * ny + j]; };
    double x = 0.0, y = 0.0, xx = 0.0, yy = 0.0, xy = 0.0;
    for (Index i = 0; i < nx; ++i) {
        for (Index j = 0; j < ny; ++j) {
            const Index ip = std::min(i + 1, nx - 1), im = std::max(i - 1, 0);
            const Index jp = std::min(j + 1, ny - 1), jm = std::max(j - 1, 0);
            x = std::max(x, std::abs(c(ip, j) - c(i, j)));
            y = std::max(y, std::abs(c(i, jp) - c(i, j)));
            xx = std::max(xx, std::abs(c(ip, j) - 2.0 * c(i, j) + c(im, j)));
            yy = std::max(yy, std::abs(c(i, jp) - 2.0 * c(i, j) + c(i, jm)));
            xy = std::max(xy, std::abs(c(ip, jp) - c(ip, j) - c(i, jp) + c(i, j)));
        }
    }
    const double dx = spacing_.x(), dy = spacing_.y();
    steepest_ = std::hypot(x / dx, y / dy);
    sharpest_ = std::max(xx / (dx * dx), yy / (dy * dy)) + xy / (dx * dy);
}

void HeightField::build_blocks() {
    constexpr Index side = 8;
    const Index nx = samples_[0] + 2 * settled, ny = samples_[1] + 2 * settled;
    for (Index i = 0; i < nx; ++i)
        for (Index j = 0; j < ny; ++j) knots_.push_back(ground(Pair(knot(0, i), knot(1, j))).height);
    const auto height = [&](Index i, Index j) { return knots_[static_cast<std::size_t>(i) * ny + j]; };
    for (Index i = 0; i < nx - 1; i += side) {
        for (Index j = 0; j < ny - 1; j += side) {
            Block block{{i, j}, {std::min(i + side, nx - 1), std::min(j + side, ny - 1)}, height(i, j), 0.0};
            block.high = block.low;
            for (Index k = i; k <= block.last[0]; ++k) {
                for (Index l = j; l <= block.last[1]; ++l) {
                    block.low = std::min(block.low, height(k, l));
                    block.high = std::max(block.high, height(k, l));
                }
            }
            blocks_.push_back(block);
        }
    }
}

HeightField::Ground HeightField::ground(const Pair& at) const {
    const Place x = place_of((at.x() - origin_.x()) / spacing_.x(), samples_[0]);
    const Place y = place_of((at.y() - origin_.y()) / spacing_.y(), samples_[1]);
    double sums[3][3] = {};  // [times differentiated by x][by y]
    for (int i = 0; i < 4; ++i) {
        const double* row = coefficients_.data() + x.index[i] * (samples_[1] + 2);
        for (int b = 0; b < 3; ++b) {
            double along = 0.0;
            for (int j = 0; j < 4; ++j) along += y.weights[b][j] * row[y.index[j]];
            for (int a = 0; a + b < 3; ++a) sums[a][b] += x.weights[a][i] * along;
        }
    }
    const double px = 1.0 / spacing_.x(), py = 1.0 / spacing_.y();
    Ground g{sums[0][0], Pair(px * sums[1][0], py * sums[0][1]), {}};
    const double xy = px * py * sums[1][1];
    g.bend << px * px * sums[2][0], xy, xy, py * py * sums[0][2];
    return g;
}

double HeightField::knot(int axis, Index i) const {
    return origin_[axis] + (i - settled) * spacing_[axis];
}

HeightField::Range HeightField::range(int axis, Index first, Index last) const {
    constexpr double endless = std::numeric_limits<double>::infinity();
    return {first == 0 ? -endless : knot(axis, first),
            last == samples_[axis] + 2 * settled - 1 ? endless : knot(axis, last)};
}

double HeightField::squared_bound(const Block& block, const Vec3& point) const {
    const double x = range(0, block.first[0], block.last[0]).clamp(point.x()) - point.x();
    const double y = range(1, block.first[1], block.last[1]).clamp(point.y()) - point.y();
    const double z = std::clamp(point.z(), block.low, block.high) - point.z();
    return x * x + y * y + z * z;
}

void HeightField::scan_block(const Block& block, const Vec3& point, double& least, Pair& best) const {
    const Index ny = samples_[1] + 2 * settled;
    for (Index i = block.first[0]; i < block.last[0]; ++i) {
        const double x = range(0, i, i + 1).clamp(point.x());
        const double s = std::clamp((x - knot(0, i)) / spacing_.x(), 0.0, 1.0);
        for (Index j = block.first[1]; j < block.last[1]; ++j) {
            const double y = range(1, j, j + 1).clamp(point.y());
            const double t = std::clamp((y - knot(1, j)) / spacing_.y(), 0.0, 1.0);
            const double* corner = knots_.data() + static_cast<std::size_t>(i) * ny + j;
            const double height = (1.0 - s) * ((1.0 - t) * corner[0] + t * corner[1]) +
                                  s * ((1.0 - t) * corner[ny] + t * corner[ny + 1]);
            const double squared = (Vec3(x, y, height) - point).squaredNorm();
            if (squared < least) least = squared, best = Pair(x, y);
        }
    }
}

// Finds about the nearest point of the bilinear surface: each cell is evaluated at one place only, the one below the
// point or nearest to that. Returns `start`, where the surface lies `gap` below the point, if that is nearer still.
HeightField::Pair HeightField::scan(const Vec3& point, const Pair& start, double gap) const {
    double least = (start - point.head<2>()).squaredNorm() + gap * gap;
    Pair best = start;
    const Block* first = nullptr;  // the most promising block: it leaves little for the others
    double lowest = least;
    for (const Block& block : blocks_) {
        const double bound = squared_bound(block, point);
        if (bound < lowest) lowest = bound, first = &block;
    }
    if (!first) return best;
    scan_block(*first, point, least, best);
    for (const Block& block : blocks_)
        if (&block != first && squared_bound(block, point) < least) scan_block(block, point, least, best);
    return best;
}

// Minimizes D by Newton's method; where its second derivatives are not positive definite, those of Gauss-Newton
// are used.
HeightField::Pair HeightField::nearest(const Vec3& point, Pair at) const {
    const double close =
        1e-8 * spacing_.minCoeff();  // convergence is quadratic: the next step would be below round-off
    Ground g = ground(at);
    const auto half_square = [&](const Pair& where, const Ground& there) {
        const double rise = there.height - point.z();
        return 0.5 * ((where - point.head<2>()).squaredNorm() + rise * rise);
    };
    double value = half_square(at, g);
    for (int iteration = 0; iteration < 50; ++iteration) {
        const double rise = g.height - point.z();
        const Pair gradient = at - point.head<2>() + rise * g.slope;
        const Eigen::Matrix2d certain = Eigen::Matrix2d::Identity() + g.slope * g.slope.transpose();
        Eigen::Matrix2d second = certain + rise * g.bend;
        if (!(second.determinant() > 1e-6 * certain.determinant() && second.trace() > 0.0)) second = certain;
        Pair step = -second.inverse() * gradient;
        // Once the step is small, round-off alone decides between values.
        const bool last = !(step.lpNorm<Eigen::Infinity>() > close);
        for (int halving = 0;; ++halving) {
            const Pair next = at + step;
            const Ground there = ground(next);
            const double lower = half_square(next, there);
            if (last || lower <= value || halving == 20) {
                at = next, g = there, value = lower;
                break;
            }
            step *= 0.5;
        }
        if (last) break;
    }
    return at;
}

Distance HeightField::distance(const Vec3& point) const {
    if (!point.allFinite()) {
        constexpr double none = std::numeric_limits<double>::quiet_NaN();
        return {none, Vec3::Constant(none), Mat3::Constant(none)};
    }
    Pair start = point.head<2>();
    const Ground below = ground(start);
    const double gap = point.z() - below.height;
    // The nearest point is at most |gap| away. If D is convex within that distance, there is no other minimum.
    const bool convex = std::abs(gap) * (1.0 + steepest_) * sharpest_ < 1.0;
    if (!convex) start = scan(point, start, gap);

    const Pair foot = nearest(point, start);
    const Ground g = ground(foot);
    const Vec3 gradient(-g.slope.x(), -g.slope.y(), 1.0);
    Mat3 second = Mat3::Zero();
    second.topLeftCorner<2, 2>() = -g.bend;
    const Vec3 offset = point - Vec3(foot.x(), foot.y(), g.height);
    return parallel_surface(offset.dot(gradient.normalized()), gradient, second);
}

}  // namespace magshell
