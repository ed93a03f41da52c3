#include "magshell/field/cuboid.h"

#include <cmath>
#include <limits>

namespace magshell {
namespace {

// Derivatives of the potential of a cuboid in closed form. The potential is a sum over the corners, Phi(y) =
// sum -s_1 s_2 s_3 F(y - s h), s_i = -1, 1, with F_xyz = 1/r and
//
//   F_xx = -atan(y z/(x r)),   F_xy = atanh(z/r) = t (ln(r + |z|) - ln(rho)),   t = sign z, rho^2 = x^2 + y^2.
//
// The logarithm of rho belongs to the edge along z: it cancels between the edge's two ends unless z lies
// between them. If it is left out there, the rest is regular on the lines that prolong edges. All higher
// derivatives are those of the logarithms and of 1/r; F_xxx = -F_xyy - F_xzz, because F is harmonic.

/// A function of the position relative to a line: its value, and its derivatives with respect to the coordinates (b, c)
/// perpendicular to it.
struct LineFunction {
    double value, b, c, bb, bc, cc;
};

/// Returns t ln(r + |z|), at the distances x, y from the line.
LineFunction end_of_line(double x, double y, double z, double r, double t) {
    const double length = std::abs(z), sum = r + length;
    // slope / rho; once and twice differentiated
    const double g = t / (r * sum), h = -g * (2.0 * r + length) / (r * r * sum);
    return {t * std::log(sum), x * g, y * g, g + x * x * h, x * y * h, g + y * y * h};
}

/// Returns ln(rho^2); NaN on the line.
LineFunction whole_line(double x, double y) {
    const double square = x * x + y * y;
    if (square == 0.0) {
        constexpr double nan = std::numeric_limits<double>::quiet_NaN();
        return {nan, nan, nan, nan, nan, nan};
    }
    const double bx = x / square, by = y / square, bend = 2.0 * (by * by - bx * bx);
    return {std::log(square), 2.0 * bx, 2.0 * by, bend, -4.0 * bx * by, -bend};
}

/// Adds F_bc = f and the derivatives that follow from it.
void add_line(int b, int c, const LineFunction& f, int order, PotentialDerivatives& out) {
    out.second[derivative_index(b, c)] += f.value;
    if (order < 3) return;
    out.third[derivative_index(b, b, c)] += f.b;
    out.third[derivative_index(b, c, c)] += f.c;
    out.third[derivative_index(b, b, b)] -= f.c;
    out.third[derivative_index(c, c, c)] -= f.b;
    if (order < 4) return;
    out.fourth[derivative_index(b, b, b, c)] += f.bb;
    out.fourth[derivative_index(b, b, c, c)] += f.bc;
    out.fourth[derivative_index(b, c, c, c)] += f.cc;
    out.fourth[derivative_index(b, b, b, b)] -= f.bc;
    out.fourth[derivative_index(c, c, c, c)] -= f.bc;
}

constexpr std::array<int, 3> next = {1, 2, 0}, after = {2, 0, 1};

/// Returns the derivatives of F at x relative to a corner; side: the signs of x.
PotentialDerivatives corner(const Vec3& x, const Vec3& side, int order) {
    PotentialDerivatives out;
    double r = x.norm();
    if (r == 0.0) r = std::numeric_limits<double>::quiet_NaN();
    for (int a = 0; a < 3; ++a) {
        const int b = next[a], c = after[a];
        out.second[derivative_index(a, a)] = -std::atan2(side[a] * x[b] * x[c], std::abs(x[a]) * r);
        add_line(b, c, end_of_line(x[b], x[c], x[a], r, side[a]), order, out);
        if (order >= 4) out.fourth[derivative_index(0, 1, 2, a)] = -x[a] / (r * r * r);
    }
    out.third[derivative_index(0, 1, 2)] = 1.0 / r;
    return out;
}

}  // namespace

Cuboid::Cuboid(const Vec3& dimensions) : half_(0.5 * dimensions), far_(FarShape::cuboid, half_) {}

void Cuboid::set_sizes(std::span<const double> dimensions) {
    *this = Cuboid(Vec3(dimensions.data()));
}

bool Cuboid::contains(const Vec3& y) const {
    return ((y - half_).array() < 0.0).all() && ((y + half_).array() > 0.0).all();
}

/// Calls add(factor, sides, derivatives) for each corner, and for each edge between whose ends the point lies.
/// `sides` says with which faces a piece moves; an edge has no entry along itself.
template <class Add>
void Cuboid::for_each_piece(const Vec3& y, int order, const Add& add) const {
    const std::array<Vec3, 2> from = {y + half_, y - half_};  // the lower faces, and the upper ones
    std::array<Vec3, 2> signs;
    for (int a = 0; a < 3; ++a)
        for (int s = 0; s < 2; ++s) signs[s][a] = outward_sign(from[s][a], 2 * s - 1);
    for (int n = 0; n < 8; ++n) {
        const std::array<int, 3> s = {n & 1, (n >> 1) & 1, n >> 2};
        const Vec3 x(from[s[0]][0], from[s[1]][1], from[s[2]][2]);
        const Vec3 sides(2 * s[0] - 1, 2 * s[1] - 1, 2 * s[2] - 1);
        add(-sides.prod(), sides, corner(x, {signs[s[0]][0], signs[s[1]][1], signs[s[2]][2]}, order));
    }
    for (int a = 0; a < 3; ++a) {
        if (signs[0][a] == signs[1][a]) continue;
        const int b = next[a], c = after[a];
        for (int n = 0; n < 4; ++n) {
            Vec3 sides = Vec3::Zero();
            sides[b] = 2 * (n & 1) - 1;
            sides[c] = 2 * (n >> 1) - 1;
            PotentialDerivatives edge;
            add_line(b, c, whole_line(from[n & 1][b], from[n >> 1][c]), order, edge);
            add(-sides[b] * sides[c], sides, edge);
        }
    }
}

void Cuboid::derivatives(const Vec3& y, int order, PotentialDerivatives& out) const {
    if (far_.holds(y)) return far_.add(y, order, out);
    for_each_piece(y, order, [&](double factor, const Vec3&, const PotentialDerivatives& piece) {
        out.add(factor, piece, order);
    });
}

void Cuboid::derivatives_by_size(const Vec3& y, PotentialDerivatives& out,
                                 std::span<PotentialDerivatives> by_size) const {
    if (far_.holds(y)) {
        far_.add_with_sizes(y, out, by_size);
        for (PotentialDerivatives& each : by_size) each.scale(0.5);
        return;
    }
    for_each_piece(y, 4, [&](double factor, const Vec3& sides, const PotentialDerivatives& piece) {
        out.add(factor, piece, 4);
        for (int a = 0; a < 3; ++a) by_size[a].add_slope(-0.5 * factor * sides[a], piece, a);
    });
}

}  // namespace magshell
