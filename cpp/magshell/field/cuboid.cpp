#include "magshell/field/cuboid.h"

#include <cmath>
#include <limits>

#include "magshell/core/simd_angle.h"
#include "magshell/core/simd_functions.h"

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
/// perpendicular to it. Number: double, or SimdDouble for several lines.
template <class Number>
struct LineFunction {
    Number value, b, c, bb, bc, cc;
};

/// The derivatives of F at a point relative to the corners of a cuboid, one corner in each lane.
struct CornerDerivatives {
    std::array<SimdDouble, 6> second;
    std::array<SimdDouble, 10> third;
    std::array<SimdDouble, 15> fourth;

    CornerDerivatives() {
        second.fill(0.0);
        third.fill(0.0);
        fourth.fill(0.0);
    }

    PotentialDerivatives of_lane(int lane, int order) const {
        PotentialDerivatives out;
        for (int n = 0; n < 6; ++n) out.second[n] = second[n][lane];
        if (order >= 3)
            for (int n = 0; n < 10; ++n) out.third[n] = third[n][lane];
        if (order >= 4)
            for (int n = 0; n < 15; ++n) out.fourth[n] = fourth[n][lane];
        return out;
    }
};

/// Returns t ln(r + |z|), at the distances x, y from the line.
LineFunction<SimdDouble> end_of_line(const SimdDouble& x, const SimdDouble& y, const SimdDouble& z,
                                     const SimdDouble& r, const SimdDouble& t) {
    const SimdDouble length = abs(z), sum = r + length;
    // slope / rho; once and twice differentiated
    const SimdDouble g = t / (r * sum), h = -g * (2.0 * r + length) / (r * r * sum);
    return {t * log(sum), x * g, y * g, g + x * x * h, x * y * h, g + y * y * h};
}

/// Returns ln(rho^2); NaN on the line.
LineFunction<double> whole_line(double x, double y) {
    const double square = x * x + y * y;
    if (square == 0.0) {
        constexpr double nan = std::numeric_limits<double>::quiet_NaN();
        return {nan, nan, nan, nan, nan, nan};
    }
    const double bx = x / square, by = y / square, bend = 2.0 * (by * by - bx * bx);
    return {std::log(square), 2.0 * bx, 2.0 * by, bend, -4.0 * bx * by, -bend};
}

/// Adds F_bc = f and the derivatives that follow from it.
template <class Number, class Derivatives>
void add_line(int b, int c, const LineFunction<Number>& f, int order, Derivatives& out) {
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

/// Returns atan2(t y z, |x| r), which is 0 where both vanish. Their squares add up to (x^2 + y^2) (x^2 + z^2).
SimdDouble slant(const SimdDouble& x, const SimdDouble& y, const SimdDouble& z, const SimdDouble& r,
                 const SimdDouble& t) {
    const SimdDouble size = sqrt((x * x + y * y) * (x * x + z * z)), one(1.0);
    const auto both_vanish = size.lanes == SimdDouble(0.0).lanes;
    const SimdDouble inverse = one / SimdDouble(both_vanish ? one.lanes : size.lanes);
    const SimdDouble cosine(both_vanish ? one.lanes : (abs(x) * r * inverse).lanes);
    return angle_of(t * y * z * inverse, cosine);
}

/// Returns the derivatives of F at x relative to corners, NaN on a corner; side: the signs of x.
CornerDerivatives corners(std::array<SimdDouble, 3> x, const std::array<SimdDouble, 3>& side, int order) {
    CornerDerivatives out;
    const SimdDouble square = x[0] * x[0] + x[1] * x[1] + x[2] * x[2], zero(0.0);
    const SimdDouble nan(std::numeric_limits<double>::quiet_NaN());
    const SimdDouble no_number(square.lanes == zero.lanes ? nan.lanes : zero.lanes);
    const SimdDouble r = sqrt(square) + no_number;
    for (SimdDouble& each : x) each += no_number;
    for (int a = 0; a < 3; ++a) {
        const int b = next[a], c = after[a];
        out.second[derivative_index(a, a)] = -slant(x[a], x[b], x[c], r, side[a]);
        add_line(b, c, end_of_line(x[b], x[c], x[a], r, side[a]), order, out);
        if (order >= 4) out.fourth[derivative_index(0, 1, 2, a)] = -x[a] / (r * r * r);
    }
    out.third[derivative_index(0, 1, 2)] = 1.0 / r;
    return out;
}

/// Returns the lanes that hold upper corners along an axis, if the first lane holds corner `first`: bit `axis` of a corner's number
/// is set for an upper one.
auto upper_lanes(int first, int axis) {
    unsigned bits = 0;
    for (int lane = 0; lane < SimdDouble::width; ++lane) bits |= (((first + lane) >> axis) & 1u) << lane;
    return lanes_with_bits(bits);
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
    for (int first = 0; first < 8; first += SimdDouble::width) {
        std::array<SimdDouble, 3> x, side;
        for (int a = 0; a < 3; ++a) {
            const auto upper = upper_lanes(first, a);
            x[a] = SimdDouble(upper ? SimdDouble(from[1][a]).lanes : SimdDouble(from[0][a]).lanes);
            side[a] = SimdDouble(upper ? SimdDouble(signs[1][a]).lanes : SimdDouble(signs[0][a]).lanes);
        }
        const CornerDerivatives found = corners(x, side, order);
        for (int lane = 0; lane < SimdDouble::width; ++lane) {
            const int n = first + lane;
            const Vec3 sides(2 * (n & 1) - 1, 2 * ((n >> 1) & 1) - 1, 2 * (n >> 2) - 1);
            add(-sides.prod(), sides, found.of_lane(lane, order));
        }
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
