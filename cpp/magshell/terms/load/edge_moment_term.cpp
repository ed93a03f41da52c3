#include "magshell/terms/load/edge_moment_term.h"

#include <iterator>
#include <numbers>

#include "magshell/strain/dihedral_angle_six.h"

namespace magshell {
namespace {

// Returns the positions of the nodes of a couple at q, zero for absent nodes. All lanes of the SIMD vectors hold the same couple, and only lane 0
// of results is read: there are too few couples to compute several at once.
EdgeMomentTerm::Nine places(const EdgeMomentTerm::EdgeMoment& couple, const double* q) {
    EdgeMomentTerm::Nine x{};
    for (int k = 0; k < 9; ++k)
        if (couple.nodes[k] >= 0)
            for (int lane = 0; lane < SimdDouble::width; ++lane)
                set_lane(x[k], lane, q + 3 * couple.nodes[k]);
    return x;
}

// The angle between the face and the fixed direction, on an edge of a linear triangle.
DihedralAngle flat_fold(const EdgeMomentTerm::Nine& x) {
    return DihedralAngle(x[0], x[1], x[2], x[3], SimdDouble(0.0));
}

// The same angle at a Gauss point of an edge of a quadratic triangle.
DihedralAngleSix curved_fold(const EdgeMomentTerm::Nine& x, int point) {
    return DihedralAngleSix(x.data(), SimdDouble(0.0), point);
}

}  // namespace

double EdgeMomentTerm::angle(const EdgeMoment& couple, const double* q) {
    const Nine x = places(couple, q);
    return couple.point < 0 ? flat_fold(x).angle()[0] : curved_fold(x, couple.point).angle()[0];
}

EdgeMomentTerm::Nine EdgeMomentTerm::gradient(const EdgeMoment& couple, const double* q) {
    const Nine x = places(couple, q);
    Nine g{};
    if (couple.point < 0)
        flat_fold(x).gradient(g.data());
    else
        curved_fold(x, couple.point).gradient(g.data());
    return g;
}

EdgeMomentTerm::EdgeMomentTerm(const Nodes& nodes, const SystemMatrix& matrix,
                               std::vector<EdgeMoment> couples, Index rows, Registry& registry)
    : first_scalar_(nodes.first_scalar()),
      slice_(registry.values.add("couples", "couples", "N m", rows, 1)),
      factor_(registry.load_parameters.add("scene", "load_factor", "1", 1, 1)),
      couples_(std::move(couples)),
      unwrapped_angles_(couples_.size(), 0.0) {
    for (const EdgeMoment& couple : couples_) {
        PairSlots<9>& slices = slots_.emplace_back(pair_slots<9>(matrix, couple.nodes));
        // The second derivative of the angle has no block between the fixed direction and the nodes of the face that are not on the edge.
        const int direction = couple.point < 0 ? 3 : 6;
        for (int own = couple.point < 0 ? 2 : 3; own < direction; ++own)
            slices[lower_index(direction - 1, own)] = -1;
    }
}

double EdgeMomentTerm::unwrapped_angle(const double* q, std::size_t k) const {
    const EdgeMoment& couple = couples_[k];
    const double turned = angle(couple, q) - couple.rest_angle;
    return unwrapped_angles_[k] + std::remainder(turned - unwrapped_angles_[k], 2.0 * std::numbers::pi);
}

double EdgeMomentTerm::rotation_rate(const EdgeMoment& couple, const double* q, const double* lambda) const {
    const Nine g = gradient(couple, q);
    double rate = 0.0;
    for (int node = 0; node < 9; ++node)
        if (couple.nodes[node] >= 0)
            rate += lane_of(g[node], 0).dot(Eigen::Map<const Vec3>(lambda + 3 * couple.nodes[node]));
    if (couple.rotation >= 0) rate -= couple.rotation_sign * lambda[first_scalar_ + couple.rotation];
    return rate;
}

double EdgeMomentTerm::energy(const double* q, const LoadParameters& load_parameters) const {
    double work = 0.0;
    for (std::size_t k = 0; k < couples_.size(); ++k) {
        double psi = unwrapped_angle(q, k);
        if (couples_[k].rotation >= 0)
            psi -= couples_[k].rotation_sign * q[first_scalar_ + couples_[k].rotation];
        work += couples_[k].couple * psi;
    }
    return -load_parameters[factor_.first] * work;
}

void EdgeMomentTerm::evaluate(const double* q, const LoadParameters& load_parameters, Residual& out) {
    for (std::size_t k = 0; k < couples_.size(); ++k) {
        const EdgeMoment& couple = couples_[k];
        unwrapped_angles_[k] = unwrapped_angle(q, k);
        const double pull = -load_parameters[factor_.first] * couple.couple;
        const Nine g = gradient(couple, q);
        for (int node = 0; node < 9; ++node)
            if (couple.nodes[node] >= 0) scatter_node(out, couple.nodes[node], SimdDouble(pull) * g[node], 0);
        if (couple.rotation >= 0) out.add(first_scalar_ + couple.rotation, -pull * couple.rotation_sign);
    }
}

bool EdgeMomentTerm::set_values(const Values& values) {
    for (EdgeMoment& couple : couples_) couple.couple = couple.share * values.number(slice_, couple.row);
    return values.changed(slice_);
}

void EdgeMomentTerm::vjp(const double* q, const LoadParameters& load_parameters, const double* lambda,
                         Gradient& out) {
    for (const EdgeMoment& couple : couples_) {
        const double rate = rotation_rate(couple, q, lambda);
        out.values[slice_.at(couple.row)] -= load_parameters[factor_.first] * couple.share * rate;
        out.load_parameters[factor_.first] -= couple.couple * rate;
    }
}

void EdgeMomentTerm::add_rest_vjp(const double* q, const LoadParameters& load_parameters,
                                  const double* lambda, VectorXd& out) {
    for (const EdgeMoment& couple : couples_) {
        if (couple.point < 0) continue;
        const double by_share =
            -load_parameters[factor_.first] * couple.couple / couple.share * rotation_rate(couple, q, lambda);
        for (int node = 0; node < 3; ++node)
            out.segment<3>(3 * couple.nodes[node]) += by_share * couple.share_by_rest[node];
    }
}

void EdgeMomentTerm::finish_assembly(const double* q, const LoadParameters& load_parameters,
                                     SystemMatrix& out) const {
    for (std::size_t k = 0; k < couples_.size(); ++k) {
        const EdgeMoment& couple = couples_[k];
        const Nine x = places(couple, q);
        const SimdDouble moment(-load_parameters[factor_.first] * couple.couple);
        SimdMat3 h[45] = {};
        if (couple.point < 0) {
            const DihedralHessian curvature(flat_fold(x), moment);
            std::copy(std::begin(curvature.block), std::end(curvature.block), h);
        } else {
            curved_fold(x, couple.point).add_curvature(moment, h);
        }
        scatter_blocks<9>(out, couple.nodes, slots_[k], h, 0);
    }
}

}  // namespace magshell
