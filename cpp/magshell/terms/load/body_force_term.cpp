#include "magshell/terms/load/body_force_term.h"

#include <algorithm>

namespace magshell {

BodyForceTerm::BodyForceTerm(const std::vector<Input>& bodies, const std::vector<Vec3>& rest,
                             Registry& registry) {
    for (const Input& input : bodies) {
        Body& body = bodies_.emplace_back();
        std::copy_n(input.corners, 4, body.corners.begin());
        body.force = registry.values.add(input.owner, "force", "N", 1, 3);
        body.center = registry.values.add(input.owner, "center", "m", 1, 3);
        for (const Index corner : body.corners) body.middle += 0.25 * rest[corner];
        for (int k = 0; k < 4; ++k) {
            const Vec3 rho = rest[body.corners[k]] - body.middle;
            body.offsets[k] = rho * (3.0 / (4.0 * rho.squaredNorm()));  // |rho|^2 = 3 l^2
        }
    }
}

bool BodyForceTerm::set_values(const Values& values) {
    bool changed = false;
    for (Body& body : bodies_) {
        changed |= values.changed(body.force, body.center);
        body.f = values.vector(body.force);
        const Vec3 center = values.vector(body.center) - body.middle;
        for (int k = 0; k < 4; ++k) body.b[k] = 0.25 + body.offsets[k].dot(center);
    }
    return changed;
}

Vec3 BodyForceTerm::Body::at_center(const double* rows) const {
    Vec3 sum = Vec3::Zero();
    for (int k = 0; k < 4; ++k) sum += b[k] * Eigen::Map<const Vec3>(rows + 3 * corners[k]);
    return sum;
}

double BodyForceTerm::energy(const double* q, const LoadParameters&) const {
    double total = 0.0;
    for (const Body& body : bodies_) total -= body.f.dot(body.at_center(q));
    return total;
}

void BodyForceTerm::evaluate(const double*, const LoadParameters&, Residual& out) {
    for (const Body& body : bodies_)
        for (int k = 0; k < 4; ++k)
            for (int c = 0; c < 3; ++c) out.add(3 * body.corners[k] + c, -body.b[k] * body.f[c]);
}

void BodyForceTerm::vjp(const double*, const LoadParameters&, const double* lambda, Gradient& out) {
    for (const Body& body : bodies_) {
        out.values.segment<3>(body.force.first) -= body.at_center(lambda);
        for (int k = 0; k < 4; ++k)
            out.values.segment<3>(body.center.first) -=
                body.f.dot(Eigen::Map<const Vec3>(lambda + 3 * body.corners[k])) * body.offsets[k];
    }
}

}  // namespace magshell
