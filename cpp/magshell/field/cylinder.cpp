#include "magshell/field/cylinder.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>

namespace magshell {
namespace {

// Jacobi's elliptic functions on a grid, and the arithmetic-geometric mean that determines how fine the grid
// must be.

struct Jacobi {
    double sn, cn, dn;
};

/// k^2, and 1 - k^2 without cancellation.
struct Modulus {
    double square, complement;
};

/// Returns the functions of the sum of two arguments. Deviations from sn^2 + cn^2 = 1 and dn^2 = cn^2 + k'^2
/// sn^2 would grow from sum to sum, the latter as 1/k', so the result is projected onto both.
Jacobi sum_of_arguments(const Jacobi& a, const Jacobi& b, const Modulus& m) {
    const double inverse = 1.0 / (1.0 - m.square * a.sn * a.sn * b.sn * b.sn);
    double sn = (a.sn * b.cn * b.dn + b.sn * a.cn * a.dn) * inverse;
    double cn = (a.cn * b.cn - a.sn * b.sn * a.dn * b.dn) * inverse;
    const double back = 1.5 - 0.5 * (sn * sn + cn * cn);
    sn *= back;
    cn *= back;
    return {sn, cn, std::sqrt(cn * cn + m.complement * sn * sn)};
}

/// Returns the functions of a small argument, |u| < 0.3: a series for a sixteenth of it, doubled four times.
Jacobi jacobi_near_zero(double u, const Modulus& modulus) {
    const double m = modulus.square, x = u / 16.0, x2 = x * x;
    const double sn =
        x *
        (1.0 - x2 / 6.0 *
                   (1.0 + m -
                    x2 / 20.0 * (1.0 + m * (14.0 + m) - x2 / 42.0 * (1.0 + m * (135.0 + m * (135.0 + m))))));
    Jacobi result{sn, std::sqrt(1.0 - sn * sn), std::sqrt(1.0 - m * sn * sn)};
    for (int doubling = 0; doubling < 4; ++doubling) result = sum_of_arguments(result, result, modulus);
    return result;
}

/// Returns the arithmetic-geometric mean: K(k) = pi / (2 mean(1, k')).
double arithmetic_geometric_mean(double a, double b) {
    while (std::abs(a - b) > 1e-8 * a) {
        const double mean = 0.5 * (a + b);
        b = std::sqrt(a * b);
        a = mean;
    }
    return 0.5 * (a + b);
}

// Derivatives of the potential of a cylinder, by quadrature around its end rings. By Gauss's theorem the
// gradient of the potential perpendicular to the axis is that of a charge on the lateral surface,
//
//   Phi_i = -int n_i (L(z + h) - L(z - h)) R dphi,   L(z) = atanh(z/r) = t (ln(r + |z|) - ln(s)),   t = sign z,
//
// integrated over the circle; r is the distance from the point to that of the ring at an end, s its part
// perpendicular to the axis. The contribution of ln(s) cancels between the ends unless the point lies between
// them; it is then the potential of an infinite cylinder, known in closed form. The rest is regular away from
// the ring. In Jacobi's parameter u of the angle, phi = pi - 2 am(u), r is analytic with its zero at the
// distance K' from the real line, so the trapezoidal rule converges as exp(-pi n K'/K) with n points on the
// circle: to round-off with about 30 points at a tenth of the radius from the ring, and 100 at a millionth.
// Derivatives are those of the integrand, so nothing cancels near the axis.
//
// All components are along x, away from the axis, y around it and z along it; those odd in y vanish.

/// The independent derivatives of a function that is symmetric in y and harmonic, or has constant sources.
struct SymmetricDerivatives {
    double xx = 0, yy = 0, xz = 0, xxx = 0, xyy = 0, xxz = 0, yyz = 0;
    double xxxx = 0, xxyy = 0, yyyy = 0, xxxz = 0, xyyz = 0;
    double sources = 0;  // of Poisson's equation, xx + yy + zz = -sources

    PotentialDerivatives all() const {
        PotentialDerivatives out;
        out.second = {xx, 0, xz, yy, 0, -xx - yy - sources};
        out.third = {xxx, 0, xxz, xyy, 0, -xxx - xyy, 0, yyz, 0, -xxz - yyz};
        const double xxzz = -xxxx - xxyy, yyzz = -xxyy - yyyy;
        out.fourth = {xxxx, 0, xxxz, xxyy, 0, xxzz, 0, xyyz, 0, -xxxz - xyyz, yyyy, 0, yyzz, 0, -xxzz - yyzz};
        return out;
    }
};

/// The contribution of a ring: the derivatives of int n_i L R dphi, and those of int L R dphi.
struct RingSums {
    SymmetricDerivatives charged, plain;
};

/// Sums over the points of a ring of radius R, for a point at the distance rho from the axis and z above the
/// ring.
class Ring {
  public:
    Ring(double radius, double rho, double z, double t, int order, bool with_plain)
        : radius_(radius), away_(rho - radius), z_(z), t_(t), order_(order), with_plain_(with_plain) {}

    /// Adds the point with phi = pi - 2 theta, for this length of arc.
    void add(double sin, double cos, double arc) {
        const double nx = 2.0 * sin * sin - 1.0, ny = 2.0 * sin * cos;
        const double x = away_ + 2.0 * radius_ * cos * cos, y = -radius_ * ny;
        const double x2 = x * x, y2 = y * y, r2 = x2 + y2 + z_ * z_, r = std::sqrt(r2);
        const double length = std::abs(z_), sum = r + length, inverse = 1.0 / (r * sum);
        const double inverse_r = sum * inverse, inverse_sum = r * inverse, inverse_r2 = inverse_r * inverse_r;
        // slope / s of L, and the same operation applied to it once and twice
        const double g = t_ * inverse, g1 = -g * (2.0 * r + length) * inverse_r2 * inverse_sum;
        const double cx = arc * nx, cy = arc * ny, c1 = arc * inverse_r, c3 = c1 * inverse_r2;
        SymmetricDerivatives& c = sums_.charged;
        c.xx += cx * x * g;
        c.yy += cy * y * g;
        c.xz += nx * c1;
        if (order_ < 3) return;
        const double l_xx = g + x2 * g1, l_yy = g + y2 * g1;
        c.xxx += cx * l_xx;
        c.xyy += cx * l_yy;
        c.xxz -= nx * x * c3;
        c.yyz -= ny * y * c3;
        if (order_ < 4) return;
        const double g2 = g * (8.0 * r2 + length * (9.0 * r + 3.0 * length)) * inverse_r2 * inverse_r2 *
                          inverse_sum * inverse_sum;
        const double l_xxx = x * (3.0 * g1 + x2 * g2), l_xyy = x * (g1 + y2 * g2);
        c.xxxx += cx * l_xxx;
        c.xxyy += cx * l_xyy;
        c.yyyy += cy * y * (3.0 * g1 + y2 * g2);
        c.xxxz += nx * c3 * (3.0 * x2 * inverse_r2 - 1.0);
        c.xyyz += nx * c3 * (3.0 * y2 * inverse_r2 - 1.0);
        if (!with_plain_) return;
        SymmetricDerivatives& p = sums_.plain;
        p.xx += arc * l_xx;
        p.yy += arc * l_yy;
        p.xz -= x * c3;
        p.xxx += arc * l_xxx;
        p.xyy += arc * l_xyy;
        p.xxz += c3 * (3.0 * x2 * inverse_r2 - 1.0);
        p.yyz += c3 * (3.0 * y2 * inverse_r2 - 1.0);
    }

    const RingSums& sums() const { return sums_; }

  private:
    double radius_, away_, z_, t_;
    int order_;
    bool with_plain_;
    RingSums sums_;
};

RingSums ring_sums(double radius, double rho, double z, double t, int order, bool with_plain) {
    Ring ring(radius, rho, z, t, order, with_plain);
    const double across = rho - radius, largest = (rho + radius) * (rho + radius) + z * z;
    const Modulus modulus{4.0 * radius * rho / largest, (across * across + z * z) / largest};
    if (!(modulus.complement > 0.0)) {  // on the ring, or NaN
        constexpr double nan = std::numeric_limits<double>::quiet_NaN();
        ring.add(nan, nan, nan);
        return ring.sums();
    }
    const double complementary = std::sqrt(modulus.complement);
    // The lower bounds limit the number of points.
    const double mean = arithmetic_geometric_mean(1.0, std::max(complementary, 1e-16));
    const double other = arithmetic_geometric_mean(1.0, std::max(std::sqrt(modulus.square), 1e-16));
    const double ratio = other / mean;  // K/K'
    const int quarter = static_cast<int>(std::ceil(0.25 * (12.0 + 14.0 * ratio)));
    const double step = 0.25 * std::numbers::pi / (mean * quarter);  // K is 2 quarter steps
    const Jacobi one_half = jacobi_near_zero(0.5 * step, modulus),
                 one = sum_of_arguments(one_half, one_half, modulus);
    Jacobi at = one_half;
    const double arc = 4.0 * radius * step;
    for (int n = 0; n < quarter; ++n) {
        ring.add(at.sn, at.cn, arc * at.dn);
        // The mirror point, at the same distance from u = K, which is closest to the sample point.
        const double inverse = 1.0 / at.dn, k = complementary * inverse;
        ring.add(at.cn * inverse, k * at.sn, arc * k);
        at = sum_of_arguments(at, one, modulus);
    }
    return ring.sums();
}

/// Returns the derivatives of an infinite cylinder's potential, and those of its derivative with respect to the radius.
RingSums endless(double radius, double rho) {
    constexpr double pi = std::numbers::pi;
    RingSums result;
    if (rho < radius) {
        result.charged = {.xx = -2.0 * pi, .yy = -2.0 * pi, .sources = 4.0 * pi};
        return result;
    }
    const double f = 2.0 * pi * radius * radius / (rho * rho), f1 = f / rho, f2 = f1 / rho;
    result.charged = {.xx = f,
                      .yy = -f,
                      .xxx = -2.0 * f1,
                      .xyy = 2.0 * f1,
                      .xxxx = 6.0 * f2,
                      .xxyy = -6.0 * f2,
                      .yyyy = 6.0 * f2};
    const double by = 2.0 / radius;
    result.plain = {.xx = by * f, .yy = -by * f, .xxx = -2.0 * by * f1, .xyy = 2.0 * by * f1};
    return result;
}

}  // namespace

Cylinder::Cylinder(double radius, double height)
    : radius_(radius), half_height_(0.5 * height), far_(FarShape::cylinder, {radius, radius, 0.5 * height}) {}

void Cylinder::set_sizes(std::span<const double> radius_and_height) {
    *this = Cylinder(radius_and_height[0], radius_and_height[1]);
}

bool Cylinder::contains(const Vec3& y) const {
    return std::hypot(y[0], y[1]) < radius_ && y[2] - half_height_ < 0.0 && y[2] + half_height_ > 0.0;
}

Mat3 Cylinder::frame(const Vec3& y) const {
    const double rho = std::hypot(y[0], y[1]);
    const double cos = rho > 0.0 ? y[0] / rho : 1.0, sin = rho > 0.0 ? y[1] / rho : 0.0;
    Mat3 axes;
    axes << cos, -sin, 0.0, sin, cos, 0.0, 0.0, 0.0, 1.0;
    return axes;
}

/// Calls add(side, factor, derivatives) for the ring of each end, and for the infinite cylinder if the point
/// lies between the ends.
template <class Add>
void Cylinder::for_each_piece(const Vec3& y, int order, bool by_radius, const Add& add) const {
    const double rho = std::hypot(y[0], y[1]);
    double signs = 0.0;
    for (const double side : {-1.0, 1.0}) {
        const double z = y[2] - side * half_height_, t = outward_sign(z, side);
        signs += t;
        const RingSums sums = ring_sums(radius_, rho, z, t, order, by_radius);
        add(side, side, sums);
    }
    if (signs == 0.0) add(0.0, 1.0, endless(radius_, rho));
}

void Cylinder::derivatives(const Vec3& y, int order, PotentialDerivatives& out) const {
    const Vec3 here = frame(y).transpose() * y;
    if (far_.holds(here)) return far_.add(here, order, out);
    for_each_piece(y, order, false, [&](double, double factor, const RingSums& piece) {
        out.add(factor, piece.charged.all(), order);
    });
}

void Cylinder::derivatives_by_size(const Vec3& y, PotentialDerivatives& out,
                                   std::span<PotentialDerivatives> by_size) const {
    PotentialDerivatives &by_radius = by_size[0], &by_height = by_size[1];
    const Vec3 here = frame(y).transpose() * y;
    if (far_.holds(here)) {
        std::array<PotentialDerivatives, 3> by_half{};
        far_.add_with_sizes(here, out, by_half);
        by_radius.add(1.0, by_half[0], 3);
        by_radius.add(1.0, by_half[1], 3);
        by_height.add(0.5, by_half[2], 3);
        return;
    }
    for_each_piece(y, 4, true, [&](double side, double factor, const RingSums& piece) {
        const PotentialDerivatives all = piece.charged.all();
        out.add(factor, all, 4);
        by_height.add_slope(-0.5 * side * factor, all, 2);
        by_radius.add(side == 0.0 ? 1.0 : -factor, piece.plain.all(), 3);
    });
}

}  // namespace magshell
