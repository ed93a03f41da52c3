#include "magshell/terms/joint/damper_term.h"

#include <cmath>

namespace magshell {

DamperTerm::DamperTerm(const std::vector<Input>& joints, const std::vector<Vec3>& rest,
                       const SystemMatrix& matrix, Registry& registry) {
    for (const Input& input : joints) {
        const LinkPair links(input.parent, input.child, rest, matrix);
        const ParameterSlice slice = registry.values.add(input.owner, "damping", "SI", 1, 1);
        const bool length = input.joint.traits().has_lengths;
        const double reach = length ? links.reach() : 1.0 + links.reach() / links.length();
        const ParameterSlice axis =
            input.joint.has_axis() ? registry.values.add(input.owner, "axis", "1", 1, 3) : ParameterSlice{};
        const std::vector<ParameterSlice> numbers = input.joint.add_numbers(input.owner, registry.values);
        std::size_t number = 0;
        for (const JointStrain& strain : input.joint.kind->damped(input.joint)) {
            const JointForm form(strain.coordinate, input.joint.origin, links);
            each_.push_back({links, form, strain.share, slice, axis, input.joint, number++, length,
                             form.at(links.rest()).first.cwiseAbs(), reach, numbers});
        }
    }
    last_turn_.assign(each_.size(), 0.0);
    now_.resize(each_.size());
}

bool DamperTerm::set_values(const Values& values) {
    bool changed = false;
    for (Each& each : each_) {
        changed |= values.changed(each.slice);
        each.damping = each.share * values.number(each.slice);
        bool other_form = each.joint.replace_numbers(values, each.numbers);
        if (each.axis.size() > 0 && values.changed(each.axis)) {
            each.joint.axis = values.vector(each.axis);
            other_form = true;
        }
        if (!other_form) continue;
        each.form = JointForm(each.joint.kind->damped(each.joint)[each.number].coordinate, each.joint.origin,
                              each.links);
        each.at_rest = each.form.at(each.links.rest()).first.cwiseAbs();
        changed = true;
    }
    return changed;
}

double DamperTerm::stress_by_damping(std::size_t k, double strain) const {
    return history_.shift ? history_.scale * strain - history_.shift->number(static_cast<Index>(k), 0) : 0.0;
}

void DamperTerm::evaluate(const double* q, const LoadParameters&, Residual& out) {
    for (std::size_t k = 0; k < each_.size(); ++k) {
        const Each& each = each_[k];
        const Corners at = each.links.positions(q);
        now_[k] = each.form.at(at);
        now_[k].value = strain(k, at);
        if (each.form.angle() && std::isfinite(now_[k].value)) last_turn_[k] = now_[k].value;
        if (history_.shift)
            each.links.scatter(each.damping * stress_by_damping(k, now_[k].value) * now_[k].first, out);
    }
}

void DamperTerm::finish_assembly(const double*, const LoadParameters&, SystemMatrix& out) const {
    if (!history_.shift) return;
    for (std::size_t k = 0; k < each_.size(); ++k) {
        const Each& each = each_[k];
        const JointForm::Local& now = now_[k];
        const double stress = each.damping * stress_by_damping(k, now.value);
        each.links.add(stress * now.pairs, now.first, each.damping * history_.scale, now.other,
                       stress * now.cross, out);
    }
}

void DamperTerm::vjp(const double*, const LoadParameters&, const double* lambda, Gradient& out) {
    if (!history_.shift) return;
    const Strains along = strain_rates(lambda);
    for (std::size_t k = 0; k < each_.size(); ++k)
        out.values[each_[k].slice.first] +=
            each_[k].share * stress_by_damping(k, now_[k].value) * along.number(static_cast<Index>(k), 0);
}

Strains DamperTerm::strains(const double* q) {
    Strains out(elements(), 1);
    for (std::size_t k = 0; k < each_.size(); ++k)
        out.set(static_cast<Index>(k), 0, strain(k, each_[k].links.positions(q)));
    return out;
}

Strains DamperTerm::strain_rates(const double* p) {
    Strains out(elements(), 1);
    for (std::size_t k = 0; k < each_.size(); ++k)
        out.set(static_cast<Index>(k), 0, now_[k].first.cwiseProduct(each_[k].links.gather(p)).sum());
    return out;
}

Strains DamperTerm::stresses(const Strains& strains) const {
    Strains out(elements(), 1);
    for (Index k = 0; k < elements(); ++k) out.set(k, 0, each_[k].damping * strains.number(k, 0));
    return out;
}

void DamperTerm::add_forces(const Strains& stresses, Residual& out) {
    for (Index k = 0; k < elements(); ++k) each_[k].links.scatter(stresses.number(k, 0) * now_[k].first, out);
}

Strains DamperTerm::rates(const double* q, const double* v) const {
    Strains out(elements(), 1);
    for (Index k = 0; k < elements(); ++k)
        out.set(k, 0, local(each_[k], q).first.cwiseProduct(each_[k].links.gather(v)).sum());
    return out;
}

// The gradient with respect to a joint's axis. A coordinate does not depend on the axis itself, as the links rotate about
// it. Its rate does wherever node velocities contain motions that the joint does not allow, which is the case
// for the velocities of finite steps.
//
//   an angle   C = tr M - a . M a,  S = w . a,  s' = (C S' - S C')/(C^2 + S^2)     M_ij = e_i of the parent . e_j of the child
//   a length   s' is linear in a
Vec3 DamperTerm::rate_by_axis(const Each& each, const double* q, const Corners& v) const {
    const Corners at = each.links.positions(q);
    Vec3 by_axis;
    if (each.length) {
        Joint along = each.joint;
        for (int c = 0; c < 3; ++c) {
            along.axis = Vec3::Unit(c);
            const JointForm form(along.kind->form(along), along.origin, each.links);
            by_axis[c] = form.at(at).first.cwiseProduct(v).sum();
        }
    } else {
        Mat3 m, rate;
        for (int i = 0; i < 3; ++i)
            for (int j = 0; j < 3; ++j) {
                const JointForm::Local product =
                    JointForm::product(each.links, Vec3(Vec3::Unit(i)), Vec3(Vec3::Unit(j))).at(at);
                m(i, j) = product.value;
                rate(i, j) = product.first.cwiseProduct(v).sum();
            }
        const auto twist = [](const Mat3& of) {
            return Vec3(of(2, 1) - of(1, 2), of(0, 2) - of(2, 0), of(1, 0) - of(0, 1));
        };
        const Vec3 a = each.joint.axis, w = twist(m), w_rate = twist(rate);
        const Vec3 by_c = -(m + m.transpose()) * a, by_c_rate = -(rate + rate.transpose()) * a;
        const double c = m.trace() - a.dot(m * a), s = w.dot(a), c_rate = rate.trace() - a.dot(rate * a),
                     s_rate = w_rate.dot(a), size = c * c + s * s, own = (c * s_rate - s * c_rate) / size;
        by_axis = (s_rate * by_c + c * w_rate - c_rate * w - s * by_c_rate) / size -
                  2.0 * own / size * (c * by_c + s * w);
    }
    return by_axis - each.joint.axis.dot(by_axis) * each.joint.axis;
}

void DamperTerm::rates_vjp(const double* q, const double* v, const Strains& by_rates, VectorXd& by_q,
                           VectorXd& by_v, Gradient& out) const {
    for (Index k = 0; k < elements(); ++k) {
        const Each& each = each_[k];
        const JointForm::Local at = local(each, q);
        const Corners along = each.links.gather(v);
        const double by = by_rates.number(k, 0);
        each.links.add_to(by * at.first, by_v);
        each.links.add_to(by * at.second(along), by_q);
        if (each.axis.size() > 0 && by != 0.0)
            out.values.segment<3>(each.axis.first) += by * rate_by_axis(each, q, along);
    }
}

void DamperTerm::add_cancelling_stage_forces(double beyond, VectorXd& out) const {
    if (!history_.shift) return;
    for (const Each& each : each_) {
        const double rounds = each.reach + beyond / (each.length ? 1.0 : each.links.length());
        each.links.add_to(each.damping * history_.scale * rounds * each.at_rest, out);
    }
}

}  // namespace magshell
