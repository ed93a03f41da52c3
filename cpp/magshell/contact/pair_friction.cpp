#include "magshell/contact/pair_friction.h"

namespace magshell {
namespace {

SlipVectors no_vectors() {
    SlipVectors vectors;
    vectors.fill(Vec3::Zero());
    return vectors;
}

SlipVectors distributed(const PairWeights& weights, const Vec3& vector) {
    return {weights[0] * vector, weights[1] * vector, weights[2] * vector, weights[3] * vector, Vec3::Zero()};
}

}  // namespace

PairFriction::PairFriction(const PairEnergy& at, const SlipStencil& stencil, const SlipVectors& velocities,
                           const FrictionLaw& law)
    : at_(at),
      count_(stencil.count),
      corner_(stencil.corner),
      map_(at.near(), stencil),
      velocities_(velocities),
      slip_(map_.slip(velocities)),
      friction_(at.normal_force(), at.near().normal, slip_, law) {}

SlipVectors PairFriction::force_rate(const std::array<Mat3, slip_nodes>& map_rate,
                                     const Vec3& normal_rate) const {
    Vec3 slip_rate = Vec3::Zero();
    for (int k = 0; k < slip_nodes; ++k) slip_rate += map_rate[k] * velocities_[k];
    SlipVectors rate = map_.forces(friction_.by_normal * normal_rate + friction_.by_velocity * slip_rate);
    for (int k = 0; k < slip_nodes; ++k) rate[k] += map_rate[k].transpose() * friction_.force;
    return rate;
}

// Calls take(product) for each rank-one part of dF/dx, using dw, dn and dd of contact/proximity.h and dN of the energy.
template <class Take>
void PairFriction::each_product(const Take& take) const {
    if (count_ == 0) return;
    const Proximity& near = at_.near();
    Product by_force{map_.forces(friction_.by_normal_force), no_vectors()};
    const PairVectors force_by_position = at_.normal_force_by_position();
    std::copy(force_by_position.begin(), force_by_position.end(), by_force.right.begin());
    take(by_force);
    const auto take_rate = [&](const SlipMap::Rate& rate, const SlipVectors& right) {
        take(Product{force_rate(map_.rate(rate), rate.normal), right});
    };
    take_rate({.distance = 1.0}, distributed(near.weights, near.normal));
    for (int a = 0; a < 2; ++a) {
        const SlipVectors moved = distributed(near.weights, near.along[a]);
        if (a >= near.free) {
            if (near.distance > 0.0) take_rate({.normal = near.along[a] / near.distance}, moved);
            continue;
        }
        // The closest points move along the parts, and the normal tilts.
        const SlipVectors tilted = distributed(near.slide[a], near.normal);
        SlipVectors slid = moved;
        for (int k = 0; k < slip_nodes; ++k) slid[k] += near.distance * tilted[k];
        PairWeights lost = near.slide[a];
        for (double& weight : lost) weight = -weight;
        take_rate({.weights = lost}, slid);
        take_rate({.normal = -near.along[a]}, tilted);
    }
    for (int c = 0; c < 3; ++c)
        for (int axis = 0; axis < 3; ++axis) {
            Product turned{force_rate(map_.rate_by_corner(c, axis), Vec3::Zero()), no_vectors()};
            turned.right[corner_ + c] = Vec3::Unit(axis);
            take(turned);
        }
}

void PairFriction::by_position(Blocks& blocks) const {
    for (Mat3& block : blocks) block.setZero();
    each_product([&](const Product& product) {
        for (int i = 0; i < count_; ++i)
            for (int j = 0; j < count_; ++j)
                blocks[slip_nodes * i + j] += product.left[i] * product.right[j].transpose();
    });
}

PairFriction::Gradient PairFriction::vjp(const SlipVectors& lambda) const {
    const Vec3 along = map_.slip(lambda);
    Gradient by{map_.forces(friction_.by_velocity * along),
                no_vectors(),
                along.dot(friction_.by_normal_force),
                {along.dot(friction_.by_kinetic), along.dot(friction_.by_fixed),
                 along.dot(friction_.by_sticking_speed)}};
    each_product([&](const Product& product) {
        double sum = 0.0;
        for (int i = 0; i < count_; ++i) sum += lambda[i].dot(product.left[i]);
        for (int j = 0; j < count_; ++j) by.by_position[j] += sum * product.right[j];
    });
    return by;
}

}  // namespace magshell
