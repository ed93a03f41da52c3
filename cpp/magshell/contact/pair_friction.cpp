#include "magshell/contact/pair_friction.h"

namespace magshell {
namespace {

Vec3 weighted(const PairWeights& weights, const PairVectors& vectors, int count) {
    Vec3 sum = Vec3::Zero();
    for (int i = 0; i < count; ++i) sum += weights[i] * vectors[i];
    return sum;
}

PairVectors distributed(const PairWeights& weights, const Vec3& vector) {
    return {weights[0] * vector, weights[1] * vector, weights[2] * vector, weights[3] * vector};
}

}  // namespace

PairFriction::PairFriction(const PairEnergy& at, const PairVectors& velocities, const FrictionLaw& law)
    : at_(at),
      velocities_(velocities),
      friction_(at.normal_force(), at.near().normal, weighted(at.near().weights, velocities, at.count()),
                law) {}

PairVectors PairFriction::force() const {
    return distributed(at_.near().weights, friction_.force);
}

// Calls take(product) for each rank-one part of dF/dx, using dw and dn of contact/proximity.h and dN of the
// energy.
template <class Take>
void PairFriction::each_product(const Take& take) const {
    const Proximity& near = at_.near();
    take(Product{distributed(near.weights, friction_.by_normal_force), at_.normal_force_by_position()});
    for (int a = 0; a < 2; ++a) {
        const PairVectors moved = distributed(near.weights, near.along[a]);
        const PairVectors by_normal = distributed(near.weights, friction_.by_normal * near.along[a]);
        if (a >= near.free) {
            Product turned{by_normal, moved};
            for (Vec3& each : turned.right) each /= near.distance;
            take(turned);
            continue;
        }
        // The closest points move along the parts, which changes the weights of the force and of the velocity.
        const PairVectors tilted = distributed(near.slide[a], near.normal);
        const Vec3 change = friction_.by_velocity * weighted(near.slide[a], velocities_, at_.count());
        Product slid, turned{by_normal, tilted};
        for (int i = 0; i < 4; ++i) {
            slid.left[i] = near.slide[a][i] * friction_.force + near.weights[i] * change;
            slid.right[i] = -near.distance * tilted[i] - moved[i];
            turned.right[i] = -tilted[i];
        }
        take(slid);
        take(turned);
    }
}

void PairFriction::by_position(std::array<Mat3, 16>& blocks) const {
    for (Mat3& block : blocks) block.setZero();
    each_product([&](const Product& product) {
        for (int i = 0; i < 4; ++i)
            for (int j = 0; j < 4; ++j) blocks[4 * i + j] += product.left[i] * product.right[j].transpose();
    });
}

PairFriction::Gradient PairFriction::vjp(const PairVectors& lambda) const {
    const PairWeights& weights = at_.near().weights;
    const Vec3 along = weighted(weights, lambda, at_.count());
    Gradient by{distributed(weights, friction_.by_velocity * along),
                distributed(weights, Vec3::Zero()),
                along.dot(friction_.by_normal_force),
                {along.dot(friction_.by_kinetic), along.dot(friction_.by_fixed),
                 along.dot(friction_.by_sticking_speed)}};
    each_product([&](const Product& product) {
        double sum = 0.0;
        for (int i = 0; i < at_.count(); ++i) sum += lambda[i].dot(product.left[i]);
        for (int j = 0; j < 4; ++j) by.by_position[j] += sum * product.right[j];
    });
    return by;
}

}  // namespace magshell
