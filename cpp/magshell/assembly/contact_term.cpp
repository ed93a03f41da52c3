#include "magshell/assembly/contact_term.h"

#include <algorithm>

#include "magshell/core/parallel.h"

namespace magshell {
namespace {

constexpr Index block_length = 512;  // points a task

Vec3 weighted(const ContactPoint& point, const double* all) {
    Vec3 sum = Vec3::Zero();
    for (int k = 0; k < 3; ++k)
        if (point.nodes[k] >= 0) sum += point.weights[k] * Eigen::Map<const Vec3>(all + 3 * point.nodes[k]);
    return sum;
}

// Steps of the distance's own length cannot miss a surface.
bool passes(const Obstacle& shape, const Vec3& from, const Vec3& to) {
    const double length = (to - from).norm();
    Distance at = shape.distance(from);
    if (at.value > 0.0) {
        if (length <= at.value) return false;
        constexpr double smallest = 1e-3;  // of the way
        double travelled = at.value / length;
        while (at.value > 0.0) {
            if (travelled >= 1.0) return false;
            at = shape.distance(from + travelled * (to - from));
            travelled += std::max(at.value / length, smallest);
        }
    }
    return at.normal.dot(shape.distance(to).normal) < -1e-6;  // opposite faces; an edge of a box is none
}

}  // namespace

Pack33 to_pack(const Mat3& block) {
    Pack33 pack;
    for (int r = 0; r < 3; ++r)
        for (int c = 0; c < 3; ++c) pack.at[3 * r + c] = Pack(block(r, c));
    return pack;
}

ContactTerm::ContactTerm(const Sheet& sheet, const SystemMatrix& matrix,
                         const std::vector<ContactInput>& contacts) {
    for (const ContactInput& given : contacts) {
        Contact& contact = contacts_.emplace_back();
        contact.obstacles = given.obstacles;
        contact.points = given.points;
        for (ContactPoint& point : contact.points) {
            for (Index& node : point.nodes)
                if (node >= 0) node = sheet.vertices.core[node];
            if (point.nodes[1] < 0)
                ++contact.first_on_face;
            else
                contact.slots.push_back(pair_slots<3>(matrix, point.nodes));
        }
    }
}

void ContactTerm::set_values(std::vector<ContactLaw> laws, std::vector<PlacedObstacle> obstacles) {
    laws_ = std::move(laws);
    obstacles_ = std::move(obstacles);
}

StandingObstacle ContactTerm::standing(Index obstacle, const Controls& controls) const {
    return {obstacles_[obstacle], controls.obstacles.empty() ? ObstaclePose() : controls.obstacles[obstacle]};
}

std::vector<ContactTerm::Touch> ContactTerm::touches(const double* q, const Controls& controls) const {
    std::vector<Touch> all;
    for (std::size_t c = 0; c < contacts_.size(); ++c) {
        const Contact& contact = contacts_[c];
        const ContactLaw& law = laws_[c];
        const Index count = static_cast<Index>(contact.points.size());
        for (const Index o : contact.obstacles) {
            const StandingObstacle obstacle = standing(o, controls);
            std::vector<std::vector<Touch>> found((count + block_length - 1) / block_length);
            parallel_for(static_cast<int>(found.size()), [&](int block) {
                const Index first = block * block_length, last = std::min(count, first + block_length);
                for (Index p = first; p < last; ++p) {
                    const Vec3 x = weighted(contact.points[p], q);
                    const Distance at = obstacle.distance(x);
                    const double depth = law.offset - at.value;
                    if (!(depth > 0.0)) continue;
                    const Penalty penalty(depth, law.smoothing);
                    found[block].push_back({static_cast<Index>(c), o, p, x, at, law.stiffness * penalty.force,
                                            law.stiffness * penalty.stiffness,
                                            law.stiffness * penalty.force_by_smoothing});
                }
            });
            for (const std::vector<Touch>& part : found) all.insert(all.end(), part.begin(), part.end());
        }
    }
    return all;
}

Index ContactTerm::passes_through(const VectorXd& q, const Controls& controls, const VectorXd& end,
                                  const Controls& controls_at_end) const {
    for (const Contact& contact : contacts_)
        for (const Index o : contact.obstacles) {
            const StandingObstacle before = standing(o, controls), after = standing(o, controls_at_end);
            for (const ContactPoint& point : contact.points)
                if (passes(*obstacles_[o].shape, before.own(weighted(point, q.data())),
                           after.own(weighted(point, end.data()))))
                    return point.nodes[0];
        }
    return -1;
}

Vec3 ContactTerm::at_point(const Touch& touch, const double* all) const {
    return weighted(point(touch), all);
}

void ContactTerm::spread(const Touch& touch, const Vec3& vector, VectorXd& out) const {
    const ContactPoint& p = point(touch);
    for (int k = 0; k < 3; ++k)
        if (p.nodes[k] >= 0) out.segment<3>(3 * p.nodes[k]) += p.weights[k] * vector;
}

void ContactTerm::spread(const Touch& touch, const Vec3& force, Residual& out) const {
    const ContactPoint& p = point(touch);
    for (int k = 0; k < 3; ++k)
        if (p.nodes[k] >= 0)
            for (int axis = 0; axis < 3; ++axis) out.add(3 * p.nodes[k] + axis, p.weights[k] * force[axis]);
}

void ContactTerm::add_by_law(const Touch& touch, double by_force, SceneGradient& out) const {
    ContactLaw& by_law = out.contacts[touch.contact];
    by_law.stiffness += by_force * touch.force / law(touch).stiffness;
    by_law.smoothing += by_force * touch.by_smoothing;
    by_law.offset += by_force * touch.stiffness;
}

void ContactTerm::add_cancelling_force(const Touch& touch, double stiffness, VectorXd& out) const {
    const ContactPoint& p = point(touch);
    for (int k = 0; k < 3; ++k)
        if (p.nodes[k] >= 0)
            out.segment<3>(3 * p.nodes[k]).array() += p.weights[k] * stiffness * touch.place.norm();
}

void ContactTerm::add_cancelling_normal_forces(VectorXd& out) const {
    for (const Touch& touch : touching_) add_cancelling_force(touch, touch.stiffness, out);
}

void ContactTerm::add_block(const Touch& touch, const Mat3& block, SystemMatrix& out) const {
    const Contact& contact = contacts_[touch.contact];
    const ContactPoint& p = point(touch);
    if (touch.point < contact.first_on_face) {
        out.add_diagonal_block(p.nodes[0], to_pack(block), 0);
        return;
    }
    Pack33 blocks[6];
    for (int i = 0; i < 3; ++i)
        for (int j = 0; j <= i; ++j) blocks[lower_index(i, j)] = to_pack(p.weights[i] * p.weights[j] * block);
    scatter_blocks<3>(out, p.nodes, contact.slots[touch.point - contact.first_on_face], blocks, 0);
}

double ContactTerm::energy(const double* q, const Controls& controls) const {
    double total = 0.0;
    for (const Touch& touch : touches(q, controls)) {
        const ContactLaw& of = law(touch);
        total += of.stiffness * Penalty(of.offset - touch.at.value, of.smoothing).energy;
    }
    return total;
}

void ContactTerm::evaluate(const double* q, const Controls& controls, Residual& out) {
    touching_ = touches(q, controls);
    for (const Touch& touch : touching_) spread(touch, -touch.force * touch.at.normal, out);
}

void ContactTerm::finish_assembly(const double*, const Controls&, SystemMatrix& out) const {
    for (const Touch& touch : touching_) {
        const Distance& at = touch.at;
        add_block(touch, touch.stiffness * at.normal * at.normal.transpose() - touch.force * at.curvature,
                  out);
    }
}

// The gradient is g = - N n.
void ContactTerm::vjp(const double*, const Controls& controls, const double* lambda, SceneGradient& out) {
    out.contacts.resize(contacts_.size());
    out.obstacles.resize(obstacles_.size());
    for (const Touch& touch : touching_) {
        const Vec3 along = at_point(touch, lambda);
        const double by_force = -along.dot(touch.at.normal);
        add_by_law(touch, by_force, out);
        standing(touch.obstacle, controls)
            .vjp(touch.place, touch.at, -touch.stiffness * by_force, -touch.force * along, Vec3::Zero(),
                 out.obstacles[touch.obstacle]);
    }
}

std::size_t ContactTerm::bytes() const {
    std::size_t total = bytes_of(touching_);
    for (const Contact& contact : contacts_) total += bytes_of(contact.points) + bytes_of(contact.slots);
    return total;
}

}  // namespace magshell
