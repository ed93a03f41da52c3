#include "magshell/terms/joint/torque_term.h"

#include <algorithm>

namespace magshell {

TorqueTerm::TorqueTerm(std::string_view name, const std::vector<Input>& moments,
                       const std::vector<Vec3>& rest, Registry& registry)
    : name_(name) {
    for (const Input& input : moments) {
        const ParameterSlice slice = registry.values.add(input.owner, "torque", "N m", 1, 3);
        for (const Index* corners : {input.child, input.parent}) {
            if (!corners) continue;
            Side& side = sides_.emplace_back();
            std::copy_n(corners, 4, side.corners.begin());
            side.sign = corners == input.child ? 1.0 : -1.0;
            side.slice = slice;
            double squares = 0.0;  // sum of the squares of the six edges, 8 l^2 each
            for (int i = 0; i < 4; ++i)
                for (int j = 0; j < i; ++j) squares += (rest[corners[i]] - rest[corners[j]]).squaredNorm();
            side.share = 6.0 / squares;
        }
    }
}

bool TorqueTerm::set_values(const Values& values) {
    for (Side& side : sides_) side.moment = side.sign * side.share * values.vector(side.slice);
    return false;
}

std::array<Vec3, 4> TorqueTerm::Side::arms(const double* q) const {
    std::array<Vec3, 4> at;
    Vec3 center = Vec3::Zero();
    for (int k = 0; k < 4; ++k) {
        at[k] = Eigen::Map<const Vec3>(q + 3 * corners[k]);
        center += 0.25 * at[k];
    }
    for (Vec3& each : at) each -= center;
    return at;
}

void TorqueTerm::evaluate(const double* q, const LoadParameters&, Residual& out) {
    for (const Side& side : sides_) {
        const std::array<Vec3, 4> arms = side.arms(q);
        for (int k = 0; k < 4; ++k) {
            const Vec3 force = side.moment.cross(arms[k]);
            for (int c = 0; c < 3; ++c) out.add(3 * side.corners[k] + c, -force[c]);
        }
    }
}

// Adds d(-f_i)/dx_j = -[m]x (delta_ij - 1/4) / (8 l^2), because x_i - c depends on all four corners.
void TorqueTerm::add_nonsymmetric_tangent(const double*, const LoadParameters&,
                                          NonsymmetricTangent& out) const {
    for (const Side& side : sides_)
        for (int i = 0; i < 4; ++i)
            for (int j = 0; j <= i; ++j)
                out.add(NonsymmetricTangent::SkewBlock{{side.corners[i], side.corners[j]},
                                                       ((i == j ? 0.75 : -0.25) * -side.moment).eval()});
}

void TorqueTerm::vjp(const double* q, const LoadParameters&, const double* lambda, Gradient& out) {
    for (const Side& side : sides_) {
        const std::array<Vec3, 4> arms = side.arms(q);
        for (int k = 0; k < 4; ++k)
            out.values.segment<3>(side.slice.first) -=
                side.sign * side.share *
                arms[k].cross(Vec3(Eigen::Map<const Vec3>(lambda + 3 * side.corners[k])));
    }
}

}  // namespace magshell
