#include "magshell/terms/contact/contact_term.h"

#include <algorithm>
#include <cmath>
#include <string>
#include <utility>

#include "magshell/core/errors.h"
#include "magshell/core/parallel.h"
#include "magshell/core/rotation_vector.h"
#include "magshell/obstacle/passage.h"

namespace magshell {
namespace {

constexpr Index points_per_task = 512;  // [points] size of a parallel task

Vec3 weighted(const ContactPoint& point, const double* all) {
    Vec3 sum = Vec3::Zero();
    for (int k = 0; k < 3; ++k)
        if (point.nodes[k] >= 0) sum += point.weights[k] * Eigen::Map<const Vec3>(all + 3 * point.nodes[k]);
    return sum;
}

ContactTerm::AttachedNodes all_nodes(const ContactPoint& point, const CornerFrame& frame) {
    ContactTerm::AttachedNodes nodes;
    std::ranges::copy(frame.corners(), std::ranges::copy(point.nodes, nodes.begin()).out);
    return nodes;
}

}  // namespace

SimdMat3 to_simd(const Mat3& block) {
    SimdMat3 group;
    for (int r = 0; r < 3; ++r)
        for (int c = 0; c < 3; ++c) group.at[3 * r + c] = SimdDouble(block(r, c));
    return group;
}

ContactTerm::ContactTerm(const Nodes& nodes, const SystemMatrix& matrix,
                         const std::vector<ContactInput>& contacts,
                         const std::vector<std::shared_ptr<const Obstacle>>& obstacles,
                         const std::vector<CornerFrame::Corners>& frames, Registry& registry)
    : laws_(contacts.size()), stiffness_(contacts.size(), 0.0) {
    for (const CornerFrame::Corners& corners : frames)
        frames_.push_back(corners[0] < 0 ? nullptr : std::make_unique<CornerFrame>(corners, nodes.rest));
    for (const ContactInput& given : contacts) {
        const std::string owner = "contact " + std::to_string(contacts_.size());
        const auto number = [&](const char* name, const char* unit) {
            return registry.values.add(owner, name, unit, 1, 1);
        };
        Contact& contact = contacts_.emplace_back();
        contact.stiffness = number("contact_stiffness", "N/m");
        contact.smoothing = number("smoothing", "m");
        contact.offset = number("offset", "m");
        contact.friction = number("friction_coefficient", "1");
        contact.sticking_speed = number("sticking_speed", "m/s");
        contact.obstacles = given.obstacles;
        contact.points = given.points;
        contact.rounds = given.rounds;
        for (const RoundInput& round : contact.rounds) {
            contact.inner.push_back(inner_balls(round.core));
            contact.round_slots.push_back(pair_slots<RoundMotion::places>(
                matrix, RoundMotion::nodes(*frames_[round.shape], frames_[round.obstacle].get())));
        }
        for (ContactPoint& point : contact.points) {
            for (Index& node : point.nodes)
                if (node >= 0) node = nodes.vertices.core[node];
            if (point.nodes[1] < 0)
                ++contact.first_on_face;
            else
                contact.slots.push_back(pair_slots<3>(matrix, point.nodes));
        }
        for (const Index o : contact.obstacles) {
            std::vector<PairSlots<attached_nodes>>& slots = contact.attached.emplace_back();
            if (!frames_[o]) continue;
            for (const ContactPoint& point : contact.points)
                slots.push_back(pair_slots<attached_nodes>(matrix, all_nodes(point, *frames_[o])));
        }
    }
    for (const std::shared_ptr<const Obstacle>& shape : obstacles) {
        const std::string owner = "obstacle " + std::to_string(obstacles_.size());
        obstacles_.push_back({shape, {}});
        obstacle_slices_.push_back({registry.values.add(owner, "center", "m", 1, 3),
                                    registry.values.add(owner, "rotation", "rad", 1, 3),
                                    registry.load_parameters.add(owner, "pose", "SI", 4, 3)});
    }
}

bool ContactTerm::set_values(const Values& values) {
    for (std::size_t c = 0; c < contacts_.size(); ++c) {
        const Contact& contact = contacts_[c];
        stiffness_[c] = values.number(contact.stiffness);
        laws_[c] = {factor_ * stiffness_[c], values.number(contact.smoothing), values.number(contact.offset),
                    values.number(contact.friction), values.number(contact.sticking_speed)};
    }
    for (std::size_t o = 0; o < obstacles_.size(); ++o)
        obstacles_[o].placement = {values.vector(obstacle_slices_[o].center),
                                   values.vector(obstacle_slices_[o].rotation)};
    return false;  // none of its forces cancel in add_cancelling_forces
}

void ContactTerm::set_factor(double factor) {
    factor_ = factor;
    for (std::size_t c = 0; c < contacts_.size(); ++c) laws_[c].stiffness = factor * stiffness_[c];
}

ObstacleState ContactTerm::obstacle_state(Index obstacle, const LoadParameters& load_parameters) const {
    const ParameterSlice& pose = obstacle_slices_[obstacle].pose;
    const auto row = [&](Index k) -> Vec3 { return load_parameters.segment<3>(pose.at(k)); };
    return {obstacles_[obstacle], ObstaclePose{row(0), row(1), row(2), row(3)}};
}

void ContactTerm::obstacle_vjp(const ActiveContact& active, const ObstacleState& obstacle, double by_distance,
                               const Vec3& by_normal, const Vec3& by_relative_velocity,
                               ObstacleGradient& out) {
    if (!active.relative)
        return obstacle.vjp(active.position, active.at, by_distance, by_normal, by_relative_velocity, out);
    // The pose of an attached obstacle relative to its rigid body does not change, so that no velocity depends on it.
    const RelativeMotion& relative = *active.relative;
    obstacle.vjp(relative.at_rest(), relative.in_body(active.at), by_distance,
                 relative.axes.transpose() * by_normal, Vec3::Zero(), out);
}

void ContactTerm::add_vjp(const ActiveContact& active, double by_force, const ContactLaw& by_friction,
                          const ObstacleGradient& by_obstacle, VectorXd& by_values,
                          LoadParameters& by_load_parameters) const {
    const Contact& contact = contacts_[active.contact];
    by_values[contact.stiffness.first] += by_force * active.force / stiffness_[active.contact];
    by_values[contact.smoothing.first] += by_force * active.by_smoothing;
    by_values[contact.offset.first] += by_force * active.stiffness;
    by_values[contact.friction.first] += by_friction.friction;
    by_values[contact.sticking_speed.first] += by_friction.sticking_speed;
    const ObstacleSlices& obstacle = obstacle_slices_[active.obstacle];
    by_values.segment<3>(obstacle.center.first) += by_obstacle.placement.center;
    by_values.segment<3>(obstacle.rotation.first) += by_obstacle.placement.rotation_vector;
    const auto by_row = [&](Index k) { return by_load_parameters.segment<3>(obstacle.pose.at(k)); };
    by_row(0) += by_obstacle.pose.displacement;
    by_row(1) += by_obstacle.pose.rotation_vector;
    by_row(2) += by_obstacle.pose.velocity;
    by_row(3) += by_obstacle.pose.spin;
}

std::vector<ContactTerm::ActiveContact> ContactTerm::active_contacts(
    const double* q, const LoadParameters& load_parameters) const {
    std::vector<ActiveContact> all;
    for (std::size_t c = 0; c < contacts_.size(); ++c) {
        const Contact& contact = contacts_[c];
        const ContactLaw& law = laws_[c];
        const Index count = static_cast<Index>(contact.points.size());
        add_active_rounds(static_cast<Index>(c), q, load_parameters, all);
        for (const Index o : contact.obstacles) {
            const ObstacleState obstacle = obstacle_state(o, load_parameters);
            const CornerFrame* const frame = frames_[o].get();
            const CornerFrame::Pose pose = frame ? frame->pose(q) : CornerFrame::Pose();
            std::vector<std::vector<ActiveContact>> found((count + points_per_task - 1) / points_per_task);
            parallel_for(static_cast<int>(found.size()), [&](int block) {
                const Index first = block * points_per_task, last = std::min(count, first + points_per_task);
                for (Index p = first; p < last; ++p) {
                    const Vec3 x = weighted(contact.points[p], q);
                    const Distance at = obstacle.distance(frame ? frame->at_rest(pose, x) : x);
                    const double depth = law.offset - at.value;
                    if (!(depth > 0.0)) continue;
                    const Penalty penalty(depth, law.smoothing);
                    found[block].push_back({static_cast<Index>(c), o, p, x, at, law.stiffness * penalty.force,
                                            law.stiffness * penalty.stiffness,
                                            law.stiffness * penalty.force_by_smoothing});
                    if (!frame) continue;
                    ActiveContact& active = found[block].back();
                    active.relative = std::make_shared<RelativeMotion>(*frame, pose, x);
                    active.at = active.relative->in_world(at);
                }
            });
            for (const std::vector<ActiveContact>& part : found)
                all.insert(all.end(), part.begin(), part.end());
        }
    }
    return all;
}

void ContactTerm::add_active_rounds(Index c, const double* q, const LoadParameters& load_parameters,
                                    std::vector<ActiveContact>& out) const {
    const Contact& contact = contacts_[c];
    const ContactLaw& law = laws_[c];
    for (std::size_t k = 0; k < contact.rounds.size(); ++k) {
        const RoundInput& given = contact.rounds[k];
        const ObstacleState obstacle = obstacle_state(given.obstacle, load_parameters);
        const CornerFrame* const frame = frames_[given.obstacle].get();
        const CornerFrame::Pose pose = frame ? frame->pose(q) : CornerFrame::Pose();
        const RoundMotion motion(
            given, obstacles_[given.shape].placement, *frames_[given.shape], frame,
            [&](const Vec3& x) -> Distance {
                if (!frame) return obstacle.distance(x);
                return RelativeMotion(*frame, pose, x).in_world(obstacle.distance(frame->at_rest(pose, x)));
            },
            q);
        const Distance gap = motion.gap();
        const double depth = law.offset - gap.value;
        if (!(depth > 0.0)) continue;
        const Penalty penalty(depth, law.smoothing);
        out.push_back({c, given.obstacle, static_cast<Index>(contact.points.size() + k), motion.point(), gap,
                       law.stiffness * penalty.force, law.stiffness * penalty.stiffness,
                       law.stiffness * penalty.force_by_smoothing});
        out.back().round = std::make_shared<RoundMotion>(motion);
        if (frame) out.back().relative = std::make_shared<RelativeMotion>(*frame, pose, motion.point());
    }
}

std::shared_ptr<const ContactTerm::ActiveContact> ContactTerm::on_surface(const ActiveContact& active) {
    const std::shared_ptr<ActiveContact> there = std::make_shared<ActiveContact>(active);
    there->round = std::make_shared<RoundMotion>(active.round->on_surface());
    there->position = there->round->point();
    return there;
}

void ContactTerm::add_round_vjp(const ActiveContact& active, const RoundMotion& motion,
                                const RoundMotion::Slopes& slopes, const ContactLaw& by_friction,
                                const ObstacleState& obstacle, VectorXd& by_values,
                                LoadParameters& by_load_parameters) const {
    const Contact& contact = contacts_[active.contact];
    const Index shape = contact.rounds[active.point - contact.points.size()].shape;
    Placement by_shape;
    const RoundMotion::ByObstacle by =
        motion.vjp(slopes, active.stiffness, obstacles_[shape].placement, by_shape);
    ObstacleGradient by_obstacle;
    obstacle_vjp(active, obstacle, by.by_distance, by.by_normal, Vec3::Zero(), by_obstacle);
    if (!active.relative)
        obstacle.vjp(motion.point(), {0.0, Vec3::Zero(), Mat3::Zero()}, 0.0, Vec3::Zero(), slopes.by_velocity,
                     by_obstacle);
    add_vjp(active, slopes.by_force, by_friction, by_obstacle, by_values, by_load_parameters);
    by_values.segment<3>(obstacle_slices_[shape].center.first) += by_shape.center;
    by_values.segment<3>(obstacle_slices_[shape].rotation.first) += by_shape.rotation_vector;
}

std::string Passage::describe(const Nodes& all) const {
    if (is_round) return "the shape of a rigid body passes through an obstacle";
    if (nodes[1] < 0)
        return "vertex " + std::to_string(all.user_vertex(nodes[0])) + " passes through an obstacle";
    std::string vertices;
    for (const Index node : nodes)
        vertices += (vertices.empty() ? "" : ", ") + std::to_string(all.user_vertex(node));
    return "an obstacle passes between the points in contact through the face of vertices " + vertices;
}

void ContactTerm::watch(const Nodes& nodes, std::vector<WatchedObstacle> watched) {
    watched_ = std::move(watched);
    for (WatchedObstacle& each : watched_)
        for (std::array<Index, 3>& face : each.faces)
            for (Index& vertex : face) vertex = nodes.vertices.core[vertex];
}

Passage ContactTerm::passes_through(const VectorXd& q, const LoadParameters& load_parameters,
                                    const VectorXd& end, const LoadParameters& load_parameters_at_end) const {
    return passes_between(own_positions(q, load_parameters), own_positions(end, load_parameters_at_end));
}

std::vector<Vec3> ContactTerm::inner_centers(const RoundInput& round, const std::vector<InnerBall>& balls,
                                             const double* q) const {
    const Placement& placed = obstacles_[round.shape].placement;
    const CornerFrame& frame = *frames_[round.shape];
    const CornerFrame::Pose pose = frame.pose(q);
    const Mat3 turned = rotation(placed.rotation_vector);
    std::vector<Vec3> centers;
    for (const InnerBall& ball : balls) {
        const Vec3 rest = placed.center + turned * ball.center;
        centers.push_back(pose.center + pose.axes * (rest - frame.rest_center()));
    }
    return centers;
}

Vec3 ContactTerm::own_position(Index obstacle, const ObstacleState& at, const VectorXd& q,
                               const Vec3& x) const {
    const CornerFrame* const frame = frames_[obstacle].get();
    return at.own(frame ? frame->at_rest(frame->pose(q.data()), x) : x);
}

std::vector<Vec3> ContactTerm::own_positions(const VectorXd& q, const LoadParameters& load_parameters) const {
    std::vector<Vec3> places;
    for (const Contact& contact : contacts_)
        for (const Index o : contact.obstacles) {
            const ObstacleState obstacle = obstacle_state(o, load_parameters);
            for (const ContactPoint& point : contact.points)
                places.push_back(own_position(o, obstacle, q, weighted(point, q.data())));
        }
    for (const Contact& contact : contacts_)
        for (std::size_t k = 0; k < contact.rounds.size(); ++k) {
            const RoundInput& round = contact.rounds[k];
            const ObstacleState obstacle = obstacle_state(round.obstacle, load_parameters);
            for (const Vec3& x : inner_centers(round, contact.inner[k], q.data()))
                places.push_back(own_position(round.obstacle, obstacle, q, x));
        }
    for (const WatchedObstacle& each : watched_) {
        const ObstacleState obstacle = obstacle_state(each.obstacle, load_parameters);
        for (const std::array<Index, 3>& face : each.faces)
            for (const Index node : face)
                places.push_back(own_position(each.obstacle, obstacle, q, q.segment<3>(3 * node)));
    }
    return places;
}

Passage ContactTerm::passes_between(const std::vector<Vec3>& before, const std::vector<Vec3>& after) const {
    std::size_t k = 0;
    for (const Contact& contact : contacts_)
        for (const Index o : contact.obstacles)
            for (const ContactPoint& point : contact.points) {
                if (magshell::passes_through(*obstacles_[o].shape, before[k], after[k]))
                    return {{point.nodes[0], -1, -1}};
                ++k;
            }
    for (const Contact& contact : contacts_)
        for (std::size_t r = 0; r < contact.rounds.size(); ++r) {
            const RoundInput& round = contact.rounds[r];
            for (const InnerBall& ball : contact.inner[r]) {
                if (magshell::passes_through(*obstacles_[round.obstacle].shape, before[k], after[k],
                                             ball.radius))
                    return {{frames_[round.shape]->corners()[0], -1, -1}, true};
                ++k;
            }
        }
    for (const WatchedObstacle& each : watched_)
        for (const std::array<Index, 3>& face : each.faces) {
            const std::array<Vec3, 3> from{before[k], before[k + 1], before[k + 2]},
                to{after[k], after[k + 1], after[k + 2]};
            k += 3;
            for (const Vec3& middle : each.middles)
                if (sweeps_over(from, to, middle)) return {face};
        }
    return {};
}

std::vector<Vec3> ContactTerm::rotation_vectors(const LoadParameters& load_parameters) const {
    std::vector<Vec3> all;
    for (std::size_t o = 0; o < obstacles_.size(); ++o) {
        all.push_back(obstacles_[o].placement.rotation_vector);
        all.push_back(load_parameters.segment<3>(obstacle_slices_[o].pose.at(1)));
    }
    return all;
}

Vec3 ContactTerm::at_point(const ActiveContact& active, const double* all) const {
    if (active.round) return active.round->motion(all);
    const Vec3 at = weighted(point(active), all);
    return active.relative ? at + active.relative->motion(all) : at;
}

ContactTerm::AttachedNodes ContactTerm::attached_nodes_of(const ActiveContact& active) const {
    return all_nodes(point(active), *active.relative->frame);
}

Mat3 ContactTerm::jacobian(const ActiveContact& active, int place) const {
    if (place < point_nodes) return point(active).weights[place] * Mat3::Identity();
    return active.relative->jacobian(place - point_nodes);
}

template <class Add>
void ContactTerm::distribute_to_nodes(const ActiveContact& active, const Vec3& vector, const Add& add) const {
    if (active.round) {
        const RoundMotion::Nodes nodes = active.round->nodes();
        for (int k = 0; k < RoundMotion::places; ++k)
            if (nodes[k] >= 0) add(nodes[k], active.round->reaction(k, vector));
        return;
    }
    const ContactPoint& p = point(active);
    for (int k = 0; k < point_nodes; ++k)
        if (p.nodes[k] >= 0) add(p.nodes[k], Vec3(p.weights[k] * vector));
    for (int k = 0; k < 4 && active.relative; ++k)
        add(active.relative->corner(k), active.relative->reaction(k, vector));
}

void ContactTerm::distribute(const ActiveContact& active, const Vec3& vector, VectorXd& out) const {
    distribute_to_nodes(active, vector,
                        [&out](Index node, const Vec3& own) { out.segment<3>(3 * node) += own; });
}

void ContactTerm::distribute(const ActiveContact& active, const Vec3& force, Residual& out) const {
    distribute_to_nodes(active, force, [&out](Index node, const Vec3& own) {
        for (int axis = 0; axis < 3; ++axis) out.add(3 * node + axis, own[axis]);
    });
}

void ContactTerm::add_cancelling_force(const ActiveContact& active, double stiffness, VectorXd& out) const {
    const double force = stiffness * active.position.norm();
    if (active.round) {
        const RoundMotion::Nodes nodes = active.round->nodes();
        for (int k = 0; k < RoundMotion::places; ++k)
            if (nodes[k] >= 0)
                out.segment<3>(3 * nodes[k]).array() += active.round->jacobian(k).norm() * force;
        return;
    }
    const ContactPoint& p = point(active);
    for (int k = 0; k < point_nodes; ++k)
        if (p.nodes[k] >= 0) out.segment<3>(3 * p.nodes[k]).array() += p.weights[k] * force;
    for (int k = 0; k < 4 && active.relative; ++k)
        out.segment<3>(3 * active.relative->corner(k)).array() += active.relative->jacobian(k).norm() * force;
}

void ContactTerm::add_cancelling_normal_forces(VectorXd& out) const {
    for (const ActiveContact& active : evaluated_contacts_)
        add_cancelling_force(active, active.stiffness, out);
}

void ContactTerm::add_block(const ActiveContact& active, const Mat3& block, SystemMatrix& out) const {
    if (active.round) {
        std::array<Mat3, RoundMotion::places> jacobians;
        for (int i = 0; i < RoundMotion::places; ++i) jacobians[i] = active.round->jacobian(i);
        add_round_blocks(
            active, [&](int i, int j) -> Mat3 { return jacobians[i].transpose() * block * jacobians[j]; },
            out);
        return;
    }
    const Contact& contact = contacts_[active.contact];
    const ContactPoint& p = point(active);
    if (active.relative) {
        std::array<Mat3, attached_nodes> jacobians;
        for (int i = 0; i < attached_nodes; ++i) jacobians[i] = jacobian(active, i);
        add_attached_blocks(
            active, [&](int i, int j) -> Mat3 { return jacobians[i].transpose() * block * jacobians[j]; },
            out);
        return;
    }
    if (active.point < contact.first_on_face) {
        out.add_diagonal_block(p.nodes[0], to_simd(block), 0);
        return;
    }
    SimdMat3 blocks[6];
    for (int i = 0; i < 3; ++i)
        for (int j = 0; j <= i; ++j) blocks[lower_index(i, j)] = to_simd(p.weights[i] * p.weights[j] * block);
    scatter_blocks<3>(out, p.nodes, contact.slots[active.point - contact.first_on_face], blocks, 0);
}

template <class Block>
void ContactTerm::add_round_blocks(const ActiveContact& active, const Block& block, SystemMatrix& out) const {
    constexpr int all = RoundMotion::places;
    SimdMat3 blocks[all * (all + 1) / 2];
    const RoundMotion::Nodes nodes = active.round->nodes();
    for (int i = 0; i < all; ++i)
        for (int j = 0; j <= i; ++j)
            if (nodes[i] >= 0 && nodes[j] >= 0) blocks[lower_index(i, j)] = to_simd(block(i, j));
    const Contact& contact = contacts_[active.contact];
    scatter_blocks<all>(out, nodes, contact.round_slots[active.point - contact.points.size()], blocks, 0);
}

template <class Block>
void ContactTerm::add_attached_blocks(const ActiveContact& active, const Block& block,
                                      SystemMatrix& out) const {
    SimdMat3 blocks[attached_nodes * (attached_nodes + 1) / 2];
    for (int i = 0; i < attached_nodes; ++i)
        for (int j = 0; j <= i; ++j) blocks[lower_index(i, j)] = to_simd(block(i, j));
    const Contact& contact = contacts_[active.contact];
    const auto obstacle = std::ranges::find(contact.obstacles, active.obstacle) - contact.obstacles.begin();
    scatter_blocks<attached_nodes>(out, attached_nodes_of(active), contact.attached[obstacle][active.point],
                                   blocks, 0);
}

// The second derivative of y along u and v, times R n: sum_k s_k (u_k . (v - v_c) + v_k . (u - u_c)), s_k = w_k . R^T n, with u at the
// point and u_c at the middle of the corners.
void ContactTerm::add_rotation_curvature(const ActiveContact& active, SystemMatrix& out) const {
    std::array<double, attached_nodes> slopes{}, shares{};
    for (int k = 0; k < point_nodes; ++k) shares[k] = point(active).weights[k];
    for (int k = 0; k < 4; ++k) {
        slopes[point_nodes + k] = active.relative->levers[k].dot(active.at.normal);
        shares[point_nodes + k] = -0.25;
    }
    add_attached_blocks(
        active,
        [&](int i, int j) -> Mat3 {
            const double sum = slopes[i] * shares[j] + slopes[j] * shares[i];
            return -active.force * sum * Mat3::Identity();
        },
        out);
}

double ContactTerm::energy(const double* q, const LoadParameters& load_parameters) const {
    double total = 0.0;
    for (const ActiveContact& active : active_contacts(q, load_parameters)) {
        const ContactLaw& of = law(active);
        total += of.stiffness * Penalty(of.offset - active.at.value, of.smoothing).energy;
    }
    return total;
}

std::vector<ContactTerm::HardContact> ContactTerm::hard_contacts() const {
    std::vector<HardContact> all;
    for (std::size_t c = 0; c < contacts_.size(); ++c) {
        if (!contacts_[c].rounds.empty())
            throw InvalidInput("Coulomb's law node by node is for vertices, not for shapes of rigid bodies");
        for (const Index obstacle : contacts_[c].obstacles)
            for (const ContactPoint& p : contacts_[c].points) {
                if (frames_[obstacle])
                    throw InvalidInput("Coulomb's law node by node is for obstacles that no body carries");
                if (p.nodes[1] >= 0)
                    throw InvalidInput("Coulomb's law node by node is for vertices: take face_samples=0");
                all.push_back({p.nodes[0], obstacle, laws_[c].offset, laws_[c].friction});
            }
    }
    return all;
}

void ContactTerm::add_contact_stiffness(VectorXd& of_nodes) const {
    for (const ActiveContact& active : evaluated_contacts_) {
        if (active.round) {
            for (const Index node : active.round->nodes())
                if (node >= 0) of_nodes[node] += 0.25 * active.stiffness;
            continue;
        }
        const ContactPoint& p = point(active);
        for (int k = 0; k < 3; ++k)  // row sums of stiffness w w^T
            if (p.nodes[k] >= 0) of_nodes[p.nodes[k]] += p.weights[k] * active.stiffness;
        for (int k = 0; k < 4 && active.relative; ++k)
            of_nodes[active.relative->corner(k)] += 0.25 * active.stiffness;
    }
}

void ContactTerm::evaluate(const double* q, const LoadParameters& load_parameters, Residual& out) {
    evaluated_contacts_ = switched_off_ ? std::vector<ActiveContact>() : active_contacts(q, load_parameters);
    for (const ActiveContact& active : evaluated_contacts_)
        distribute(active, -active.force * active.at.normal, out);
}

void ContactTerm::finish_assembly(const double*, const LoadParameters&, SystemMatrix& out) const {
    for (const ActiveContact& active : evaluated_contacts_) {
        if (active.round) {
            add_round_blocks(
                active,
                [&](int i, int j) { return active.round->hessian(i, j, active.force, active.stiffness); },
                out);
            continue;
        }
        const Distance& at = active.at;
        add_block(active, active.stiffness * at.normal * at.normal.transpose() - active.force * at.curvature,
                  out);
        if (active.relative) add_rotation_curvature(active, out);
    }
}

// The gradient of the energy is g = - N n.
void ContactTerm::vjp(const double*, const LoadParameters& load_parameters, const double* lambda,
                      Gradient& out) {
    for (const ActiveContact& active : evaluated_contacts_) {
        const Vec3 along = at_point(active, lambda);
        const double by_force = -along.dot(active.at.normal);
        if (active.round) {
            const RoundMotion::Slopes slopes{.by_force = by_force,
                                             .by_normal = -active.force * along,
                                             .by_motion = -active.force * active.at.normal,
                                             .lambda = lambda};
            add_round_vjp(active, *active.round, slopes, {}, obstacle_state(active.obstacle, load_parameters),
                          out.values, out.load_parameters);
            continue;
        }
        ObstacleGradient by_obstacle;
        obstacle_vjp(active, obstacle_state(active.obstacle, load_parameters), -active.stiffness * by_force,
                     -active.force * along, Vec3::Zero(), by_obstacle);
        add_vjp(active, by_force, {}, by_obstacle, out.values, out.load_parameters);
    }
}

std::size_t ContactTerm::bytes() const {
    std::size_t total = bytes_of(evaluated_contacts_);
    for (const Contact& contact : contacts_)
        total += bytes_of(contact.points) + bytes_of(contact.slots) + bytes_of(contact.round_slots);
    return total;
}

}  // namespace magshell
