#include "magshell/terms/joint/joint_term.h"

#include <algorithm>
#include <cmath>
#include <utility>

#include "magshell/core/rotation_vector.h"

namespace magshell {
namespace {

using Corners = CornerForm::Corners;

constexpr double small_angle = 1e-4;
// smallest angle [rad]: ratios of odd functions of the angle stay finite there
constexpr double no_angle = 1e-100;

const JointLaw::Names& names_of(const Joint& joint, JointTerm::Act act) {
    if (act == JointTerm::Act::ball_servo) return JointLaw::of_ball_servos;
    return act == JointTerm::Act::cone ? JointLaw::of_cones : joint.traits().law;
}

}  // namespace

JointTerm::JointTerm(const std::vector<Input>& joints, const std::vector<Vec3>& rest,
                     const SystemMatrix& matrix, Registry& registry)
    : last_turn_(joints.size(), 0.0), slopes_(joints.size()) {
    for (const Input& input : joints) {
        Each& each = each_.emplace_back();
        const Joint& joint = each.joint = input.joint;
        each.act = input.act;
        each.links = LinkPair(input.parent, input.child, rest, matrix);
        const LinkPair& links = each.links;
        each.reach = each.length() ? links.reach() : 1.0 + links.reach() / links.length();
        const auto add = [&](const char* name, const char* unit, Index width) {
            return registry.values.add(input.owner, name, unit, 1, width);
        };
        if (each.act == Act::closure) {
            each.slices.push_back(add("stiffness", "N/m", 1));
            each.geometry = add("origin", "m", 3);
        } else {
            for (const char* name : names_of(joint, each.act))
                each.slices.push_back(name ? add(name, "SI", 1) : ParameterSlice{});
            if (each.act == Act::ball_servo)
                each.geometry = add("target_rotation", "rad", 3);
            else if (each.act == Act::cone || joint.has_axis())
                each.geometry = add("axis", "1", 3);
            if (each.act == Act::coordinate) each.numbers = joint.add_numbers(input.owner, registry.values);
            const JointCoordinate own = joint.kind->form(joint);
            each.top = each.act == Act::cone ? 1.0 : own.top;
            each.cosine = each.act == Act::cone ? 1.0 : own.cosine;
        }
        each.find_form();
    }
}

void JointTerm::Each::find_form() {
    switch (act) {
        case Act::coordinate:
            form = JointForm(joint.kind->form(joint), joint.origin, links);
            break;
        case Act::ball_servo:
            form = JointForm::product(links, rotation(target_rotation), Mat3::Identity());
            break;
        case Act::cone:
            form = JointForm::product(links, joint.axis, joint.axis);
            break;
        case Act::closure:
            gap = links.point(true, joint.origin) - links.point(false, joint.origin);
            at_rest = Vec3::Ones() * gap.weights.cwiseAbs().transpose();
            return;
    }
    at_rest = form.at(links.rest()).first.cwiseAbs();
}

bool JointTerm::set_values(const Values& values) {
    bool changed = false;
    for (Each& each : each_) {
        for (const ParameterSlice& slice : each.slices) changed |= slice.size() > 0 && values.changed(slice);
        const auto number = [&](int k) {
            return each.slices[k].size() > 0 ? values.number(each.slices[k]) : 0.0;
        };
        bool other_form = each.joint.replace_numbers(values, each.numbers);
        if (each.geometry.size() > 0 && values.changed(each.geometry)) {
            const Vec3 now = values.vector(each.geometry);
            (each.act == Act::ball_servo ? each.target_rotation
             : each.act == Act::closure  ? each.joint.origin
                                         : each.joint.axis) = now;
            other_form = true;
        }
        if (other_form) each.find_form();
        changed |= other_form;
        if (each.act == Act::closure)
            each.stiffness = number(0);
        else
            each.law = {number(0), number(1), number(2), number(3), number(4),
                        number(5), number(6), number(7), number(8), number(9)};
        // An angle that is known by its cosine only is never negative, so the lower limit must not act.
        if (each.cosine > 0.0) each.law.lower = -1.0;
    }
    return changed;
}

Vec3 JointTerm::gap(const Each& joint, const Corners& at) const {
    return at * joint.gap.weights + joint.gap.fixed;
}

double JointTerm::coordinate(std::size_t k, const Corners& at) const {
    const Each& each = each_[k];
    const double value = each.form.value(at, last_turn_[k]);
    if (each.cosine == 0.0) return value;
    return 2.0 * std::asin(std::sqrt(std::clamp(0.5 * (each.top - value) / each.cosine, 0.0, 1.0)));
}

JointTerm::State JointTerm::state(std::size_t k, const double* q) const {
    const Each& each = each_[k];
    const Corners at = each.links.positions(q);
    State s{each.form.at(at), coordinate(k, at), 0.0, 0.0, 1.0};
    if (each.cosine > 0.0) s.coordinate = std::max(s.coordinate, no_angle);
    const JointEnergy law = law_at(each, s.coordinate);
    s.by_first = law.force;
    s.by_second = law.stiffness;
    if (each.cosine == 0.0) return s;
    const double sine = std::sin(s.coordinate);
    s.share = -1.0 / (each.cosine * sine);
    s.by_first = s.share * law.force;
    s.by_second = s.coordinate < small_angle
                      ? 0.5 * law.force / s.coordinate - law.stiffness / 6.0 +
                            JointEnergy::softening(each.law, s.coordinate)
                      : (law.stiffness * sine - law.force * std::cos(s.coordinate)) / (sine * sine * sine);
    s.by_second /= each.cosine * each.cosine;
    return s;
}

double JointTerm::energy(const double* q, const LoadParameters&) const {
    double total = 0.0;
    for (std::size_t k = 0; k < each_.size(); ++k) {
        const Corners at = each_[k].links.positions(q);
        total += each_[k].act == Act::closure ? 0.5 * each_[k].stiffness * gap(each_[k], at).squaredNorm()
                                              : law_at(each_[k], coordinate(k, at)).energy;
    }
    return total;
}

void JointTerm::evaluate(const double* q, const LoadParameters&, Residual& out) {
    for (std::size_t k = 0; k < each_.size(); ++k) {
        const Each& each = each_[k];
        if (each.act == Act::closure) {
            const Vec3 pull =
                frozen_ ? (*frozen_)[k].pull : each.stiffness * gap(each, each.links.positions(q));
            each.links.scatter(pull * each.gap.weights.transpose(), out);
            continue;
        }
        const State now = state(k, q);
        if (each.form.angle() && std::isfinite(now.coordinate)) last_turn_[k] = now.coordinate;
        slopes_[k] = {now.form.first, now.by_second};
        each.links.scatter((frozen_ ? (*frozen_)[k].by_first : now.by_first) * now.form.first, out);
    }
}

void JointTerm::freeze_stress_rates(const double* p) {
    std::vector<FrozenRate> rates(each_.size());
    for (std::size_t k = 0; k < each_.size() && p; ++k) {
        const Corners moved = each_[k].links.gather(p);
        if (each_[k].act == Act::closure)
            rates[k].pull = each_[k].stiffness * (moved * each_[k].gap.weights);
        else
            rates[k].by_first = slopes_[k].by_second * CornerForm::inner(slopes_[k].first, moved);
    }
    frozen_ = std::move(rates);
}

void JointTerm::finish_assembly(const double* q, const LoadParameters&, SystemMatrix& out) const {
    for (std::size_t k = 0; k < each_.size(); ++k) {
        const Each& each = each_[k];
        if (each.act == Act::closure) {
            if (frozen_) continue;
            const Corners none = Corners::Zero();
            each.links.add(each.stiffness * each.gap.weights * each.gap.weights.transpose(), none, 0.0, none,
                           0.0, out);
            continue;
        }
        const State now = state(k, q);
        const double by_first = frozen_ ? (*frozen_)[k].by_first : now.by_first;
        each.links.add(by_first * now.form.pairs, now.form.first, frozen_ ? 0.0 : now.by_second,
                       now.form.other, by_first * now.form.cross, out);
    }
}

void JointTerm::add_cancelling_forces(double beyond, VectorXd& out) const {
    for (const Each& each : each_) {
        const double rounds = each.reach + beyond / (each.length() ? 1.0 : each.links.length()),
                     stiffness = each.act == Act::closure
                                     ? each.stiffness
                                     : each.law.spring_stiffness + each.law.servo_stiffness +
                                           each.law.limit_stiffness;
        each.links.add_to(stiffness * rounds * each.at_rest, out);
    }
}

void JointTerm::vjp(const double* q, const LoadParameters&, const double* lambda, Gradient& out) {
    for (std::size_t k = 0; k < each_.size(); ++k) {
        const Each& each = each_[k];
        const Corners rate = each.links.gather(lambda);
        if (each.act == Act::closure) {
            closure_vjp(each, q, rate, out);
            continue;
        }
        const State now = state(k, q);
        const double along = now.share * CornerForm::inner(now.form.first, rate);
        const JointEnergy law = law_at(each, now.coordinate);
        for (int n = 0; n < JointLaw::size; ++n)
            if (each.slices[n].size() > 0) out.values[each.slices[n].first] += along * law.force_by[n];
        // Joint coordinates and their rates do not depend on the axis through the form alone; assembly/ adds
        // that part.
        if (each.act != Act::coordinate) geometry_vjp(each, now, q, rate, out);
    }
}

void JointTerm::closure_vjp(const Each& each, const double* q, const Corners& rate, Gradient& out) const {
    const Corners at = each.links.positions(q);
    const Vec3 off = gap(each, at), along = rate * each.gap.weights;
    out.values[each.slices[0].first] += off.dot(along);
    for (int c = 0; c < 3; ++c) {
        const CornerSum by = each.links.vector(true, Vec3::Unit(c)) - each.links.vector(false, Vec3::Unit(c));
        out.values[each.geometry.first + c] +=
            each.stiffness * ((at * by.weights + by.fixed).dot(along) + off.dot(rate * by.weights));
    }
}

void JointTerm::geometry_vjp(const Each& each, const State& now, const double* q, const Corners& rate,
                             Gradient& out) const {
    const Corners at = each.links.positions(q);
    const double along = CornerForm::inner(now.form.first, rate);
    const Vec3& axis = each.joint.axis;
    const Mat3 turn = rotation(each.target_rotation);
    Vec3 by = Vec3::Zero();
    for (int c = 0; c < 3; ++c) {
        const Vec3 unit = Vec3::Unit(c);
        const auto add = [&](const JointForm& form) {
            const JointForm::Local change = form.at(at);
            by[c] +=
                now.by_second * change.value * along + now.by_first * change.first.cwiseProduct(rate).sum();
        };
        if (each.act == Act::ball_servo) {
            Mat3 turned;
            for (int column = 0; column < 3; ++column) turned.col(column) = unit.cross(turn.col(column));
            add(JointForm::product(each.links, turned, Mat3::Identity()));
        } else {
            add(JointForm::product(each.links, unit, axis));
            add(JointForm::product(each.links, axis, unit));
        }
    }
    out.values.segment<3>(each.geometry.first) += each.act == Act::ball_servo
                                                      ? transposed_jacobian_times(each.target_rotation, by)
                                                      : by - axis.dot(by) * axis;
}

}  // namespace magshell
