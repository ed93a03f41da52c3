// Of a model, forces that no energy has: loads that follow the bodies, and what acts in time steps only. And obstacles in
// the way of those.
#include <algorithm>

#include "magshell/core/errors.h"
#include "magshell/scene/model.h"
#include "magshell/term/body_contact_term.h"
#include "magshell/term/low_rank_term.h"

namespace magshell {

void Model::add_remainders(const VectorXd& q, const Controls& controls) {
    remainder_.clear();
    unsymmetric_ = false;
    if (!follows_) return;
    for (const std::unique_ptr<Term>& term : terms_)
        term->add_nonsymmetric_tangent(q.data(), controls, remainder_);
    unsymmetric_ = feels_skews(0);
}

bool Model::feels_skews(std::size_t from) const {
    return std::any_of(remainder_.skews().begin() + static_cast<std::ptrdiff_t>(from),
                       remainder_.skews().end(), [&](const Remainder::Skew& each) {
                           return reduction_.feels_skew(each.nodes[0], each.nodes[1], each.axis);
                       });
}

void Model::require_symmetric() const {
    if (!unsymmetric_) return;
    if (std::none_of(terms_.begin(), terms_.end(),
                     [](const auto& term) { return term->name() == "pressure"; }))
        throw InvalidInput(
            "the torque of a Ball has no potential, so the stiffness is not symmetric. Equilibria, motions "
            "and "
            "their gradients can be computed, vibrations, buckling loads and followed paths cannot: take the "
            "torques of Revolute joints instead");
    throw InvalidInput(
        "the pressure has no potential here, so the stiffness is not symmetric: its faces end at a "
        "border that is "
        "free, or neighbouring faces have different pressures. Equilibria, motions and their gradients "
        "can be "
        "computed, vibrations, buckling loads and followed paths cannot: close the surface, hold its "
        "border, or "
        "give one pressure to all of it");
}

void Model::begin_step(const VectorXd& q, const Controls& controls) {
    for (const std::unique_ptr<ForceTerm>& force : forces_) force->begin_step(q, controls);
}

std::string Model::blocked(const VectorXd& q, const Controls& controls, const VectorXd& end,
                           const Controls& controls_at_end) const {
    const Index node = contact_ ? contact_->passes_through(q, controls, end, controls_at_end) : -1;
    if (node < 0) return {};
    return "vertex " + std::to_string(nodes().user_vertex(node)) +
           " passes through an obstacle within a step";
}

void Model::evaluate_forces(const VectorXd& q, const Controls& controls, const StageMotion& stage) {
    const Index coordinates = n_coordinates();
    kinematics_.q = q;
    kinematics_.rate = 1.0 / stage.time;
    kinematics_.v.setZero(size());
    kinematics_.w.setZero(size());
    kinematics_.v.head(coordinates) = kinematics_.rate * (q - *stage.x_hat).head(coordinates);
    kinematics_.w.head(coordinates) = kinematics_.rate * (kinematics_.v - *stage.v_hat).head(coordinates);
    for (const std::unique_ptr<ForceTerm>& force : forces_) force->evaluate(kinematics_, controls, residual_);
}

std::vector<PairStiffness> Model::touching_pairs() const {
    std::vector<PairStiffness> pairs;
    if (!body_contact_) return pairs;
    body_contact_->add_stiffness(pairs);
    for (const std::unique_ptr<ForceTerm>& force : forces_) force->add_stiffness(kinematics_, pairs);
    return pairs;
}

void Model::add_cancelling_forces_here(bool in_motion, VectorXd& out) const {
    for (const LowRankTerm* term : borders_) term->add_cancelling_here(out);
    if (contact_) contact_->add_cancelling_normal_forces(out);
    if (body_contact_) body_contact_->add_cancelling_normal_forces(out);
    if (!in_motion) return;
    for (const std::unique_ptr<ForceTerm>& force : forces_) force->add_cancelling_forces(kinematics_, out);
}

void Model::hold_forces(bool held) {
    for (const std::unique_ptr<ForceTerm>& force : forces_) force->set_frozen(held);
}

void Model::assemble_forces(const Controls& controls, bool cautious) {
    const std::size_t before = remainder_.skews().size();
    for (const std::unique_ptr<ForceTerm>& force : forces_)
        force->assemble(kinematics_, controls, cautious, matrix_, remainder_);
    unsymmetric_ = unsymmetric_ || remainder_.of_motion() || feels_skews(before);
}

KinematicsGradient Model::forces_vjp(const Controls& controls, const VectorXd& lambda, Gradient& out) const {
    KinematicsGradient by{VectorXd::Zero(size()), VectorXd::Zero(size()), VectorXd::Zero(size()),
                          no_controls()};
    for (const std::unique_ptr<ForceTerm>& force : forces_)
        force->vjp(kinematics_, controls, lambda, by, out);
    return by;
}

}  // namespace magshell
