#include "magshell/term/couple_term.h"

#include <numbers>

#include "magshell/strain/fold_angle.h"

namespace magshell {
namespace {

// One couple a pack: they sit on boundaries and are few.
Fold fold_at(const CoupleTerm::Couple& couple, const double* q) {
    Pack3 x[4];
    for (int k = 0; k < 4; ++k)
        for (int lane = 0; lane < Pack::width; ++lane) set_lane(x[k], lane, q + 3 * couple.nodes[k]);
    return Fold(x[0], x[1], x[2], x[3], Pack(0.0));
}

}  // namespace

CoupleTerm::CoupleTerm(const Nodes& nodes, const SystemMatrix& matrix, std::vector<Couple> couples,
                       Registry& registry)
    : first_scalar_(nodes.first_scalar()),
      slot_(registry.values.add("couples", "couples", "N m", static_cast<Index>(couples.size()), 1)),
      factor_(registry.controls.add("scene", "load_factor", "1", 1, 1)),
      couples_(std::move(couples)),
      last_turn_(couples_.size(), 0.0) {
    for (const Couple& couple : couples_) {
        slots_.push_back(pair_slots<4>(matrix, couple.nodes));
        slots_.back()[lower_index(2, 2)] = -1;
    }
}

double CoupleTerm::turn(const double* q, std::size_t k) const {
    const Couple& couple = couples_[k];
    const double angle = fold_at(couple, q).angle()[0] - couple.rest_angle;
    return last_turn_[k] + std::remainder(angle - last_turn_[k], 2.0 * std::numbers::pi);
}

double CoupleTerm::energy(const double* q, const Controls& controls) const {
    double work = 0.0;
    for (std::size_t k = 0; k < couples_.size(); ++k) {
        double psi = turn(q, k);
        if (couples_[k].rotation >= 0)
            psi -= couples_[k].rotation_sign * q[first_scalar_ + couples_[k].rotation];
        work += couples_[k].couple * psi;
    }
    return -controls[factor_.first] * work;
}

void CoupleTerm::evaluate(const double* q, const Controls& controls, Residual& out) {
    for (std::size_t k = 0; k < couples_.size(); ++k) {
        const Couple& couple = couples_[k];
        last_turn_[k] = turn(q, k);
        const double pull = -controls[factor_.first] * couple.couple;
        Pack3 g[4];
        fold_at(couple, q).gradient(g);
        for (int node = 0; node < 4; ++node) scatter_node(out, couple.nodes[node], Pack(pull) * g[node], 0);
        if (couple.rotation >= 0) out.add(first_scalar_ + couple.rotation, -pull * couple.rotation_sign);
    }
}

bool CoupleTerm::set_values(const Values& values) {
    for (std::size_t k = 0; k < couples_.size(); ++k)
        couples_[k].couple = values.number(slot_, static_cast<Index>(k));
    return values.changed(slot_);
}

void CoupleTerm::vjp(const double* q, const Controls& controls, const double* lambda, Gradient& out) {
    for (std::size_t k = 0; k < couples_.size(); ++k) {
        const Couple& couple = couples_[k];
        Pack3 g[4];
        fold_at(couple, q).gradient(g);
        double turn_rate = 0.0;
        for (int node = 0; node < 4; ++node)
            turn_rate += lane_of(g[node], 0).dot(Eigen::Map<const Vec3>(lambda + 3 * couple.nodes[node]));
        if (couple.rotation >= 0) turn_rate -= couple.rotation_sign * lambda[first_scalar_ + couple.rotation];
        out.values[slot_.at(static_cast<Index>(k))] -= controls[factor_.first] * turn_rate;
        out.controls[factor_.first] -= couple.couple * turn_rate;
    }
}

void CoupleTerm::finish_assembly(const double* q, const Controls& controls, SystemMatrix& out) const {
    for (std::size_t k = 0; k < couples_.size(); ++k) {
        FoldCurvature curvature(fold_at(couples_[k], q));
        for (Pack33& block : curvature.block)
            block = Pack(-controls[factor_.first] * couples_[k].couple) * block;
        scatter_blocks<4>(out, couples_[k].nodes, slots_[k], curvature.block, 0);
    }
}

}  // namespace magshell
