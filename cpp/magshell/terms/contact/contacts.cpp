#include "magshell/terms/contact/contacts.h"

#include <algorithm>

namespace magshell {

void Contacts::set_factor(double factor) const {
    if (obstacles_) obstacles_->set_factor(factor);
    if (bodies_) bodies_->set_factor(factor);
}

void Contacts::evaluate(const VectorXd& q, const Kinematics& at, const LoadParameters& load_parameters,
                        Residual& out) const {
    if (obstacles_) obstacles_->evaluate(q.data(), load_parameters, out);
    if (bodies_) bodies_->evaluate(q.data(), load_parameters, out);
    for (ForceTerm* friction : frictions_) friction->evaluate(at, load_parameters, out);
}

void Contacts::assemble(const VectorXd& q, const Kinematics& at, const LoadParameters& load_parameters,
                        SystemMatrix& out, NonsymmetricTangent& rest) const {
    if (obstacles_) obstacles_->finish_assembly(q.data(), load_parameters, out);
    if (bodies_) {
        bodies_->set_psd_projection(false);
        bodies_->prepare_assembly(q.data(), load_parameters);
        bodies_->finish_assembly(q.data(), load_parameters, out);
    }
    for (const ForceTerm* friction : frictions_) friction->assemble(at, load_parameters, false, out, rest);
}

void Contacts::vjp(const VectorXd& q, const Kinematics& at, const LoadParameters& load_parameters,
                   const VectorXd& lambda, KinematicsGradient& by, Gradient& out) const {
    if (obstacles_) obstacles_->vjp(q.data(), load_parameters, lambda.data(), out);
    if (bodies_) bodies_->vjp(q.data(), load_parameters, lambda.data(), out);
    for (const ForceTerm* friction : frictions_) friction->vjp(at, load_parameters, lambda, by, out);
}

void Contacts::add_rest_vjp(const VectorXd& q, const LoadParameters& load_parameters, const VectorXd& lambda,
                            VectorXd& out) const {
    if (bodies_) bodies_->add_rest_vjp(q.data(), load_parameters, lambda.data(), out);
    // Friction needs no kinematics here: it reads the normal forces of its last evaluation.
    for (const ForceTerm* friction : frictions_) friction->add_rest_vjp({}, lambda, out);
}

double Contacts::energy(const VectorXd& q, const LoadParameters& load_parameters) const {
    return (obstacles_ ? obstacles_->energy(q.data(), load_parameters) : 0.0) +
           (bodies_ ? bodies_->energy(q.data(), load_parameters) : 0.0);
}

std::vector<Contacts::ObstaclePoint> Contacts::obstacle_points() const {
    return obstacles_ ? obstacles_->evaluated_contacts() : std::vector<ObstaclePoint>();
}

std::vector<Contacts::ObstaclePoint> Contacts::obstacle_points(const VectorXd& q,
                                                               const LoadParameters& load_parameters) const {
    return obstacles_ ? obstacles_->active_contacts(q.data(), load_parameters) : std::vector<ObstaclePoint>();
}

std::vector<Contacts::ObstaclePoint> Contacts::predicted_points(const VectorXd& p) const {
    std::vector<ObstaclePoint> all = obstacle_points();
    for (ObstaclePoint& touch : all)
        touch.force = std::max(
            0.0, touch.force - touch.stiffness * touch.at.normal.dot(obstacles_->at_point(touch, p.data())));
    return all;
}

double Contacts::force_change(const std::vector<ObstaclePoint>& earlier, const VectorXd& p) const {
    if (!obstacles_) return 0.0;
    VectorXd forces = VectorXd::Zero(p.size());
    const auto add = [&](const std::vector<ObstaclePoint>& points, double sign) {
        for (const ObstaclePoint& touch : points) {
            const Vec3& n = touch.at.normal;
            const double force = touch.stiffness * n.dot(obstacles_->at_point(touch, p.data()));
            obstacles_->distribute(touch, Vec3(sign * force * n), forces);
        }
    };
    add(obstacles_->evaluated_contacts(), 1.0);
    add(earlier, -1.0);
    return forces.norm();
}

Contacts::ObstacleFrames Contacts::obstacle_frames(const VectorXd& q,
                                                   const LoadParameters& load_parameters) const {
    if (!obstacles_) return {};
    return {obstacles_->own_positions(q, load_parameters), obstacles_->rotation_vectors(load_parameters)};
}

std::vector<Vec3> Contacts::obstacle_rotations(const LoadParameters& load_parameters) const {
    return obstacles_ ? obstacles_->rotation_vectors(load_parameters) : std::vector<Vec3>();
}

void Contacts::watch(const Nodes& nodes, const std::vector<WatchedObstacle>& watched) const {
    if (obstacles_) obstacles_->watch(nodes, watched);
}

Passage Contacts::first_crossing(const ObstacleFrames& before, const ObstacleFrames& after) const {
    return obstacles_ ? obstacles_->passes_between(before.positions, after.positions) : Passage();
}

Passage Contacts::first_crossing(const VectorXd& q, const LoadParameters& load_parameters,
                                 const VectorXd& end, const LoadParameters& load_parameters_at_end) const {
    return obstacles_ ? obstacles_->passes_through(q, load_parameters, end, load_parameters_at_end)
                      : Passage();
}

std::string Contacts::describe_blocking(const VectorXd& q, const VectorXd& p, double length) const {
    if (!bodies_ || bodies_->max_step_length(q.data(), p.data()) > length) return {};
    return "bodies block each other: " + bodies_->blocking(q.data(), p.data());
}

void Contacts::set_switched_off(bool off) const {
    if (obstacles_) obstacles_->set_switched_off(off);
    if (bodies_) bodies_->set_switched_off(off);
}

std::vector<ContactTerm::HardContact> Contacts::hard_points() const {
    if (bodies_) bodies_->require_one_coefficient();
    return obstacles_ ? obstacles_->hard_contacts() : std::vector<ContactTerm::HardContact>();
}

std::vector<BodyContactTerm::HardContactPair> Contacts::hard_pairs(const VectorXd& q) const {
    return bodies_ ? bodies_->hard_contact_pairs(q.data()) : std::vector<BodyContactTerm::HardContactPair>();
}

void Contacts::add_pair_stiffness(std::vector<PairStiffness>& out) const {
    if (bodies_) bodies_->add_stiffness(out);
}

void Contacts::add_cancelling_normal_forces(VectorXd& out) const {
    if (obstacles_) obstacles_->add_cancelling_normal_forces(out);
    if (bodies_) bodies_->add_cancelling_normal_forces(out);
}

}  // namespace magshell
