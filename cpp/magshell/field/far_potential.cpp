#include "magshell/field/far_potential.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>

namespace magshell {
namespace {

constexpr double pi = std::numbers::pi;
constexpr int most = 12;

/// Gauss points and weights on (-1, 1).
struct GaussRule {
    int count;
    std::array<double, most> place, weight;
};

GaussRule gauss_rule(int count) {
    GaussRule rule{count, {}, {}};
    for (int k = 0; k < count; ++k) {
        double x = std::cos(pi * (k + 0.75) / (count + 0.5)), slope = 1.0;
        for (int iteration = 0; iteration < 8; ++iteration) {  // Newton's method for Legendre's polynomial
            double before = 1.0, value = x;
            for (int n = 2; n <= count; ++n) {
                const double next = ((2 * n - 1) * x * value - (n - 1) * before) / n;
                before = value;
                value = next;
            }
            slope = count * (before - x * value) / (1.0 - x * x);
            x -= value / slope;
        }
        rule.place[k] = x;
        rule.weight[k] = 2.0 / ((1.0 - x * x) * slope * slope);
    }
    return rule;
}

const GaussRule& rule_of(int count) {
    static const std::array<GaussRule, most> rules = [] {
        std::array<GaussRule, most> all;
        for (int n = 1; n <= most; ++n) all[n - 1] = gauss_rule(n);
        return all;
    }();
    return rules[std::clamp(count, 1, most) - 1];
}

/// Returns the number of Gauss points for a ratio of size over distance. n points are exact for polynomials of
/// degree 2n - 1, and 1/|y - y'| is harmonic in y', so the error begins with the power 2n of the ratio; it is
/// to be 1e-13.
int points_for(double ratio) {
    return static_cast<int>(std::ceil(15.0 / std::log(1.0 / ratio)));
}

}  // namespace

FarPotential::FarPotential(FarShape shape, const Vec3& half) : shape_(shape), half_(half) {
    // Digits lost by the closed forms: sums over corners lose one digit more than those over circles.
    const double loss = shape == FarShape::cuboid ? 8e3 : 4e4;
    const double nearest = std::max(3.0 * half.norm(), std::cbrt(loss * half.prod()));
    nearest_squared_ = nearest * nearest;
}

template <class Add>
void FarPotential::for_each_charge(const Vec3& y, const Add& add) const {
    const double inverse = 1.0 / y.norm();
    const int across = points_for(half_[0] * inverse);
    const GaussRule& along = rule_of(points_for(half_[2] * inverse));
    if (shape_ == FarShape::cuboid) {
        const GaussRule &first = rule_of(across), &second = rule_of(points_for(half_[1] * inverse));
        for (int i = 0; i < first.count; ++i)
            for (int j = 0; j < second.count; ++j)
                for (int k = 0; k < along.count; ++k)
                    add(Vec3(first.place[i], second.place[j], along.place[k]),
                        half_.prod() * first.weight[i] * second.weight[j] * along.weight[k]);
        return;
    }
    const int directions = 2 * across + 2;
    const GaussRule& outward = rule_of((across + 1) / 2);  // in the squared radius
    for (int d = 0; d < directions; ++d) {
        const double angle = 2.0 * pi * (d + 0.5) / directions, cos = std::cos(angle), sin = std::sin(angle);
        for (int i = 0; i < outward.count; ++i) {
            const double radius = std::sqrt(0.5 + 0.5 * outward.place[i]);
            for (int k = 0; k < along.count; ++k)
                add(Vec3(radius * cos, radius * sin, along.place[k]),
                    half_.prod() * 0.5 * pi / directions * outward.weight[i] * along.weight[k]);
        }
    }
}

void FarPotential::add(const Vec3& y, int order, PotentialDerivatives& out) const {
    for_each_charge(y, [&](const Vec3& place, double charge) {
        add_point_charge(charge, y - half_.cwiseProduct(place), order, out);
    });
}

void FarPotential::add_with_sizes(const Vec3& y, PotentialDerivatives& out,
                                  std::span<PotentialDerivatives> by_half) const {
    PotentialDerivatives sum;
    for_each_charge(y, [&](const Vec3& place, double charge) {
        PotentialDerivatives one;
        add_point_charge(charge, y - half_.cwiseProduct(place), 4, one);
        sum.add(1.0, one, 4);
        for (int a = 0; a < 3; ++a) by_half[a].add_slope(-place[a], one, a);
    });
    out.add(1.0, sum, 4);
    for (int a = 0; a < 3; ++a) by_half[a].add(1.0 / half_[a], sum, 3);
}

}  // namespace magshell
