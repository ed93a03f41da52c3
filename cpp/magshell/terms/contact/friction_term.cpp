#include "magshell/terms/contact/friction_term.h"

namespace magshell {
namespace {

Mat3 cross_matrix(const Vec3& v) {
    Mat3 m;
    m << 0.0, -v.z(), v.y(), v.z(), 0.0, -v.x(), -v.y(), v.x(), 0.0;
    return m;
}

// Returns df/dx for a coefficient of one: the total dependence on the position through N, n and the obstacle's
// velocity.
Mat3 by_position(const Friction& friction, const ContactTerm::ActiveContact& active, const Vec3& spin) {
    return -active.stiffness * friction.by_normal_force * active.at.normal.transpose() +
           friction.by_normal * active.at.curvature - friction.by_velocity * cross_matrix(spin);
}

}  // namespace

void FrictionTerm::begin_step(const VectorXd& q, const LoadParameters& load_parameters) {
    load_parameters_before_ = load_parameters;
    contacts_.begin_step([&] { return contact_.active_contacts(q.data(), load_parameters); });
}

void FrictionTerm::evaluate(const Kinematics& at, const LoadParameters& load_parameters, Residual& out) {
    friction_contacts_.clear();
    contacts_.select(contact_.evaluated_contacts(), contact_.factor(),
                     [&](const ContactTerm::ActiveContact& active, bool lagged, double factor) {
                         const ObstacleState obstacle = contact_.obstacle_state(
                             active.obstacle, lagged ? load_parameters_before_ : load_parameters);
                         const std::shared_ptr<const ContactTerm::ActiveContact> surface =
                             active.round ? ContactTerm::on_surface(active) : nullptr;
                         const ContactTerm::ActiveContact& there = surface ? *surface : active;
                         const Vec3 velocity =
                             contact_.at_point(there, at.v.data()) - obstacle.velocity(there.position);
                         const ContactLaw& law = contact_.law(active);
                         friction_contacts_.push_back(
                             {&active, surface, lagged, factor, obstacle,
                              Friction(active.force, active.at.normal, velocity, law.sticking_speed)});
                         contact_.distribute(
                             there, -factor * law.friction * friction_contacts_.back().friction.force, out);
                     });
}

void FrictionTerm::assemble(const Kinematics& at, const LoadParameters&, bool positive_definite,
                            SystemMatrix& out, NonsymmetricTangent& rest) const {
    for (const FrictionContact& each : friction_contacts_) {
        const ContactTerm::ActiveContact& active = *each.active;
        const double coefficient = each.factor * contact_.law(active).friction;
        const Mat3& by_velocity = positive_definite ? each.friction.secant : each.friction.by_velocity;
        contact_.add_block(each.point(), -coefficient * at.rate * by_velocity, out);
        if (each.lagged || contacts_.frozen()) continue;
        if (each.surface) {
            const RoundMotion& round = *each.surface->round;
            round.add(round.by_positions(each.friction, active.stiffness, each.obstacle.spin(), at.v),
                      -coefficient, rest);
            continue;
        }
        const Mat3 block = -coefficient * by_position(each.friction, active, each.obstacle.spin());
        const ContactPoint& point = contact_.point(active);
        if (active.relative) {
            add_attached(each, attached_blocks(each, at.v), -coefficient, rest);
            continue;
        }
        if (point.nodes[1] < 0) {
            rest.add(point.nodes[0], block);
            continue;
        }
        NonsymmetricTangent::FaceBlock shared{point.nodes, point.weights, {}};
        for (int k = 0; k < 3; ++k) shared.block.middleCols<3>(3 * k) = point.weights[k] * block;
        rest.add(shared);
    }
}

// The force on the nodes is G^T f(N, n, G v), of which N, n and G change with the positions:
//
//   dN = - k n . G dx,   dn = C G dx + dR R^T n,   dR w_k = sum_j (w_j . w_k) dx_j,   dG_k = (dR w_k) d^T + (R w_k) dd^T
//
// with d = x - c, C the curvature and k the stiffness; relative_motion.h has G.
FrictionTerm::AttachedBlocks FrictionTerm::attached_blocks(const FrictionContact& each,
                                                           const VectorXd& v) const {
    constexpr int points = ContactTerm::point_nodes, all = ContactTerm::attached_nodes;
    const ContactTerm::ActiveContact& active = *each.active;
    const RelativeMotion& relative = *active.relative;
    const Friction& friction = each.friction;
    const auto overlap = [&](int j, int k) {
        return relative.frame->weight(j).dot(relative.frame->weight(k));
    };
    Mat3 by_arm = Mat3::Zero();  // of the relative velocity
    for (int k = 0; k < 4; ++k)
        by_arm += relative.levers[k] * v.segment<3>(3 * relative.corner(k)).transpose();
    const Mat3 by_place = by_position(friction, active, Vec3::Zero());
    std::array<Mat3, all> jacobians, changes;  // G, df/dx
    std::array<double, all> shares;            // dd/dx
    for (int j = 0; j < all; ++j) {
        const int corner = j - points;
        jacobians[j] = contact_.jacobian(active, j);
        shares[j] = corner < 0 ? contact_.point(active).weights[j] : -0.25;
        changes[j] = by_place * jacobians[j] + shares[j] * friction.by_velocity * by_arm;
        if (corner < 0) continue;
        double turned = 0.0;
        for (int k = 0; k < 4; ++k)
            turned += overlap(corner, k) * relative.arm.dot(v.segment<3>(3 * relative.corner(k)));
        changes[j] += relative.levers[corner].dot(active.at.normal) * friction.by_normal +
                      turned * friction.by_velocity;
    }
    AttachedBlocks blocks(all * all);
    for (int i = 0; i < all; ++i)
        for (int j = 0; j < all; ++j) {
            Mat3& sum = blocks[all * i + j];
            sum = jacobians[i].transpose() * changes[j];
            if (i < points) continue;
            sum += shares[j] * relative.levers[i - points].dot(friction.force) * Mat3::Identity();
            if (j >= points)
                sum += overlap(i - points, j - points) * relative.arm * friction.force.transpose();
        }
    return blocks;
}

void FrictionTerm::add_attached(const FrictionContact& each, const AttachedBlocks& blocks, double factor,
                                NonsymmetricTangent& rest) const {
    constexpr int points = ContactTerm::point_nodes, all = ContactTerm::attached_nodes;
    const ContactTerm::AttachedNodes nodes = contact_.attached_nodes_of(*each.active);
    // Adds the blocks between up to four places, all or only those of the first with the others.
    const auto add = [&](const std::array<int, 4>& places, bool only_of_first) {
        NonsymmetricTangent::PairBlock& pair = rest.append_pair();
        for (int a = 0; a < 4; ++a) {
            pair.nodes[a] = places[a] < 0 ? -1 : nodes[places[a]];
            for (int b = 0; b < 4; ++b) {
                const bool wanted =
                    places[a] >= 0 && places[b] >= 0 && (!only_of_first || (a == 0) != (b == 0));
                pair.blocks[4 * a + b] =
                    wanted ? Mat3(factor * blocks[all * places[a] + places[b]]) : Mat3(Mat3::Zero());
            }
        }
    };
    add({0, 1, 2, -1}, false);
    add({points, points + 1, points + 2, points + 3}, false);
    for (int k = 0; k < points; ++k) {
        if (nodes[k] < 0) continue;
        add({k, points, points + 1, -1}, true);
        add({k, points + 2, points + 3, -1}, true);
    }
}

void FrictionTerm::add_by_begin(const FrictionContact& each, double factor, const VectorXd& v,
                                const VectorXd& lambda, VectorXd& out) const {
    const auto add_blocks = [&](const auto& nodes, const std::vector<Mat3>& blocks) {
        const std::size_t all = nodes.size();
        for (std::size_t i = 0; i < all; ++i)
            for (std::size_t j = 0; j < all; ++j)
                if (nodes[i] >= 0 && nodes[j] >= 0)
                    out.segment<3>(3 * nodes[j]) +=
                        factor * blocks[all * i + j].transpose() * lambda.segment<3>(3 * nodes[i]);
    };
    const ContactTerm::ActiveContact& active = *each.active;
    const Vec3& spin = each.obstacle.spin();
    if (each.surface) {
        const RoundMotion& round = *each.surface->round;
        add_blocks(round.nodes(), round.by_positions(each.friction, active.stiffness, spin, v));
    } else if (active.relative) {
        add_blocks(contact_.attached_nodes_of(active), attached_blocks(each, v));
    } else {
        const Vec3 along = contact_.at_point(active, lambda.data());
        contact_.distribute(active, factor * by_position(each.friction, active, spin).transpose() * along,
                            out);
    }
}

void FrictionTerm::vjp(const Kinematics& at, const LoadParameters&, const VectorXd& lambda,
                       KinematicsGradient& by, Gradient& out) const {
    for (const FrictionContact& each : friction_contacts_) {
        const ContactTerm::ActiveContact& active = *each.active;
        const Friction& friction = each.friction;
        const double coefficient = each.factor * contact_.law(active).friction;
        const Vec3 along = contact_.at_point(each.point(), lambda.data());
        const Vec3 by_velocity = coefficient * (friction.by_velocity * along);
        contact_.distribute(each.point(), by_velocity, by.velocity);
        if (each.lagged) add_by_begin(each, coefficient, at.v, lambda, by.begin);
        LoadParameters& by_load_parameters = each.lagged ? by.begin_load_parameters : out.load_parameters;
        const double by_force = -coefficient * along.dot(friction.by_normal_force);
        const ContactLaw by_law{.friction = -each.factor * along.dot(friction.force),
                                .sticking_speed = -coefficient * along.dot(friction.by_sticking_speed)};
        if (each.surface) {
            const RoundMotion::Slopes slopes{
                .by_force = by_force,
                .by_normal = -coefficient * (friction.by_normal.transpose() * along),
                .by_velocity = -by_velocity,
                .by_motion = -coefficient * friction.force,
                .v = at.v.data(),
                .lambda = lambda.data(),
                .spin = each.obstacle.spin()};
            contact_.add_round_vjp(active, *each.surface->round, slopes, by_law, each.obstacle, out.values,
                                   by_load_parameters);
            continue;
        }
        ObstacleGradient by_obstacle;
        ContactTerm::obstacle_vjp(active, each.obstacle, -active.stiffness * by_force,
                                  -coefficient * (friction.by_normal.transpose() * along), -by_velocity,
                                  by_obstacle);
        contact_.add_vjp(active, by_force, by_law, by_obstacle, out.values, by_load_parameters);
    }
}

void FrictionTerm::add_cancelling_forces(const Kinematics& at, VectorXd& out) const {
    for (const FrictionContact& each : friction_contacts_) {
        const double stiffness = at.rate * each.friction.by_velocity.norm();
        contact_.add_cancelling_force(each.point(),
                                      each.factor * contact_.law(*each.active).friction * stiffness, out);
    }
}

}  // namespace magshell
