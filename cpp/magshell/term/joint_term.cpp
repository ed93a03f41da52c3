#include "magshell/term/joint_term.h"

#include <algorithm>
#include <cmath>
#include <complex>
#include <numbers>

namespace magshell {
namespace {

using Corners = CornerForm::Corners;

constexpr double small_angle = 1e-4;

Vec3 across(const Vec3& axis) {
    Index smallest;
    axis.cwiseAbs().minCoeff(&smallest);
    return axis.cross(Vec3::Unit(smallest)).normalized();
}

const JointLaw::Names& names_of(JointKind kind) {
    if (kind == JointKind::prismatic) return JointLaw::of_slides;
    return kind == JointKind::ball ? JointLaw::of_balls : JointLaw::of_turns;
}

}  // namespace

JointTerm::JointTerm(const std::vector<Input>& joints, const std::vector<Vec3>& rest,
                     const SystemMatrix& matrix, Registry& registry)
    : last_turn_(joints.size(), 0.0) {
    for (const Input& input : joints) {
        Each& each = each_.emplace_back();
        const Joint& joint = input.joint;
        each.kind = joint.kind;
        each.closure = input.closure;
        each.links = LinkPair(input.parent, input.child, rest, matrix);
        const LinkPair& links = each.links;
        const CornerSum apart = links.point(true, joint.origin) - links.point(false, joint.origin);
        if (input.closure) {
            each.gap = apart;
            each.at_rest = Vec3::Ones() * apart.weights.cwiseAbs().transpose();
            each.reach = links.reach();
            each.slots.push_back(registry.values.add(input.owner, "stiffness", "N/m", 1, 1));
            continue;
        }
        const auto add = [&](CornerForm& form, const Vec3& of_parent, const Vec3& of_child, double factor) {
            form.add(links.vector(false, of_parent), links.vector(true, of_child), factor);
        };
        if (joint.kind == JointKind::revolute) {
            const Vec3 u = across(joint.axis), v = joint.axis.cross(u);
            add(each.cosine, u, u, 1.0);
            add(each.cosine, v, v, 1.0);
            add(each.sine, v, u, 1.0);
            add(each.sine, u, v, -1.0);
        } else if (joint.kind == JointKind::prismatic)
            each.cosine.add(links.vector(false, joint.axis), apart);
        else
            for (int c = 0; c < 3; ++c) add(each.cosine, Vec3::Unit(c), Vec3::Unit(c), 1.0);
        each.at_rest =
            (joint.kind == JointKind::revolute ? each.sine : each.cosine).gradient(links.rest()).cwiseAbs() *
            (joint.kind == JointKind::revolute ? 0.5 : 1.0);
        each.reach =
            joint.kind == JointKind::prismatic ? links.reach() : 1.0 + links.reach() / links.length();
        for (const char* name : names_of(joint.kind))
            each.slots.push_back(name ? registry.values.add(input.owner, name, "SI", 1, 1) : Slot{});
    }
}

bool JointTerm::set_values(const Values& values) {
    bool changed = false;
    for (Each& each : each_) {
        for (const Slot& slot : each.slots) changed |= slot.size() > 0 && values.changed(slot);
        const auto number = [&](int k) {
            return each.slots[k].size() > 0 ? values.number(each.slots[k]) : 0.0;
        };
        if (each.closure)
            each.stiffness = number(0);
        else
            each.law = {number(0), number(1), number(2), number(3), number(4),
                        number(5), number(6), number(7), number(8), number(9)};
        // A ball joint's angle is not negative.
        if (each.kind == JointKind::ball) each.law.lower = -1.0;
    }
    return changed;
}

Vec3 JointTerm::gap(const Each& joint, const Corners& at) const {
    return at * joint.gap.weights + joint.gap.fixed;
}

double JointTerm::coordinate(std::size_t k, const Corners& at) const {
    const Each& each = each_[k];
    const double value = each.cosine.value(at);
    if (each.kind == JointKind::prismatic) return value;
    if (each.kind == JointKind::ball)
        return 2.0 * std::asin(std::sqrt(std::clamp(0.25 * (3.0 - value), 0.0, 1.0)));
    const double angle = std::atan2(each.sine.value(at), value);
    return last_turn_[k] + std::remainder(angle - last_turn_[k], 2.0 * std::numbers::pi);
}

JointTerm::State JointTerm::state(std::size_t k, const double* q) const {
    const Each& each = each_[k];
    State s;
    s.at = each.links.positions(q);
    s.coordinate = coordinate(k, s.at);
    const JointEnergy law = law_at(each, s.coordinate);
    s.by_first = law.force;
    s.by_second = law.stiffness;
    s.share = 1.0;
    s.first = each.cosine.gradient(s.at);
    if (each.kind == JointKind::revolute) {
        const std::complex<double> inverse =
            1.0 / std::complex<double>(each.cosine.value(s.at), each.sine.value(s.at));
        const Corners by_sine = each.sine.gradient(s.at), by_cosine = s.first;
        s.first = inverse.real() * by_sine + inverse.imag() * by_cosine;
        s.other = inverse.real() * by_cosine - inverse.imag() * by_sine;
    } else if (each.kind == JointKind::ball) {  // cos s = (form - 1)/2
        const double sine = std::sin(s.coordinate);
        if (s.coordinate < small_angle) {  // only the spring acts here
            s.share = -0.5;
            s.by_first = -0.5 * each.law.spring_stiffness;
            s.by_second = each.law.spring_stiffness / 12.0;
        } else {
            s.share = -0.5 / sine;
            s.by_first = s.share * law.force;
            s.by_second =
                (law.stiffness * sine - law.force * std::cos(s.coordinate)) / (4.0 * sine * sine * sine);
        }
    }
    return s;
}

double JointTerm::energy(const double* q, const Controls&) const {
    double total = 0.0;
    for (std::size_t k = 0; k < each_.size(); ++k) {
        const Corners at = each_[k].links.positions(q);
        total += each_[k].closure ? 0.5 * each_[k].stiffness * gap(each_[k], at).squaredNorm()
                                  : law_at(each_[k], coordinate(k, at)).energy;
    }
    return total;
}

void JointTerm::evaluate(const double* q, const Controls&, Residual& out) {
    for (std::size_t k = 0; k < each_.size(); ++k) {
        const Each& each = each_[k];
        if (each.closure) {
            const Vec3 pull = each.stiffness * gap(each, each.links.positions(q));
            each.links.scatter(pull * each.gap.weights.transpose(), out);
            continue;
        }
        const State now = state(k, q);
        if (each.kind == JointKind::revolute) last_turn_[k] = now.coordinate;
        each.links.scatter(now.by_first * now.first, out);
    }
}

void JointTerm::finish_assembly(const double* q, const Controls&, SystemMatrix& out) const {
    for (std::size_t k = 0; k < each_.size(); ++k) {
        const Each& each = each_[k];
        if (each.closure) {
            const Corners none = Corners::Zero();
            each.links.add(each.stiffness * each.gap.weights * each.gap.weights.transpose(), none, 0.0, none,
                           0.0, out);
            continue;
        }
        const State now = state(k, q);
        if (each.kind != JointKind::revolute) {
            each.links.add(now.by_first * each.cosine.pairs, now.first, now.by_second, now.first, 0.0, out);
            continue;
        }
        const std::complex<double> inverse =
            1.0 / std::complex<double>(each.cosine.value(now.at), each.sine.value(now.at));
        each.links.add(now.by_first * (inverse.real() * each.sine.pairs + inverse.imag() * each.cosine.pairs),
                       now.first, now.by_second, now.other, -now.by_first, out);
    }
}

void JointTerm::add_cancelling_forces(double beyond, VectorXd& out) const {
    for (const Each& each : each_) {
        const bool lengths = each.closure || each.kind == JointKind::prismatic;
        const double rounds = each.reach + beyond / (lengths ? 1.0 : each.links.length()),
                     stiffness = each.closure ? each.stiffness
                                              : each.law.spring_stiffness + each.law.servo_stiffness +
                                                    each.law.limit_stiffness;
        each.links.add_to(stiffness * rounds * each.at_rest, out);
    }
}

void JointTerm::vjp(const double* q, const Controls&, const double* lambda, Gradient& out) {
    for (std::size_t k = 0; k < each_.size(); ++k) {
        const Each& each = each_[k];
        const Corners rate = each.links.gather(lambda);
        if (each.closure) {
            out.values[each.slots[0].first] +=
                gap(each, each.links.positions(q)).dot(rate * each.gap.weights);
            continue;
        }
        const State now = state(k, q);
        const double along = now.share * now.first.cwiseProduct(rate).sum();
        if (each.kind == JointKind::ball && now.coordinate < small_angle) {
            out.values[each.slots[0].first] += along;  // force over sine is 1
            continue;
        }
        const JointEnergy law = law_at(each, now.coordinate);
        for (int n = 0; n < JointLaw::size; ++n)
            if (each.slots[n].size() > 0) out.values[each.slots[n].first] += along * law.force_by[n];
    }
}

}  // namespace magshell
