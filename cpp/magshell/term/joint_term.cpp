#include "magshell/term/joint_term.h"

#include <algorithm>
#include <cmath>

namespace magshell {
namespace {

using Corners = CornerForm::Corners;

constexpr double small_angle = 1e-4;

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
        each.form = JointForm(joint, links);
        each.at_rest = each.form.at(links.rest()).first.cwiseAbs();
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
    const double value = each.form.value(at, last_turn_[k]);
    if (each.kind != JointKind::ball) return value;
    return 2.0 * std::asin(std::sqrt(std::clamp(0.25 * (3.0 - value), 0.0, 1.0)));
}

JointTerm::State JointTerm::state(std::size_t k, const double* q) const {
    const Each& each = each_[k];
    const Corners at = each.links.positions(q);
    State s{each.form.at(at), coordinate(k, at), 0.0, 0.0, 1.0};
    const JointEnergy law = law_at(each, s.coordinate);
    s.by_first = law.force;
    s.by_second = law.stiffness;
    if (each.kind != JointKind::ball) return s;
    if (s.coordinate < small_angle) {  // cos s = (form - 1)/2; only the spring acts here
        s.share = -0.5;
        s.by_first = -0.5 * each.law.spring_stiffness;
        s.by_second = each.law.spring_stiffness / 12.0;
        return s;
    }
    const double sine = std::sin(s.coordinate);
    s.share = -0.5 / sine;
    s.by_first = s.share * law.force;
    s.by_second = (law.stiffness * sine - law.force * std::cos(s.coordinate)) / (4.0 * sine * sine * sine);
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
        if (each.kind == JointKind::revolute && std::isfinite(now.coordinate)) last_turn_[k] = now.coordinate;
        each.links.scatter(now.by_first * now.form.first, out);
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
        each.links.add(now.by_first * now.form.pairs, now.form.first, now.by_second, now.form.other,
                       now.by_first * now.form.cross, out);
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
        const double along = now.share * now.form.first.cwiseProduct(rate).sum();
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
