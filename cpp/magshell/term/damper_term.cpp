#include "magshell/term/damper_term.h"

#include <cmath>

namespace magshell {

using Corners = JointForm::Corners;

DamperTerm::DamperTerm(const std::vector<Input>& joints, const std::vector<Vec3>& rest,
                       const SystemMatrix& matrix, Registry& registry) {
    for (const Input& input : joints) {
        const LinkPair links(input.parent, input.child, rest, matrix);
        const Slot slot = registry.values.add(input.owner, "damping", "SI", 1, 1);
        const bool length = input.joint.kind == JointKind::prismatic;
        const double reach = length ? links.reach() : 1.0 + links.reach() / links.length();
        const Slot axis =
            input.joint.has_axis() ? registry.values.add(input.owner, "axis", "1", 1, 3) : Slot{};
        const auto add = [&](const JointForm& form, double share) {
            each_.push_back({links, form, share, slot, axis, input.joint, length,
                             form.at(links.rest()).first.cwiseAbs(), reach});
        };
        if (input.joint.kind != JointKind::ball) {
            add(JointForm(input.joint, links), 1.0);
            continue;
        }
        for (int a = 0; a < 3; ++a)
            for (int b = 0; b < 3; ++b) add(JointForm::product(links, Vec3(Vec3::Unit(a)), Vec3(Vec3::Unit(b))), 0.5);
    }
    last_turn_.assign(each_.size(), 0.0);
    now_.resize(each_.size());
}

bool DamperTerm::set_values(const Values& values) {
    bool changed = false;
    for (Each& each : each_) {
        changed |= values.changed(each.slot);
        each.damping = each.share * values.number(each.slot);
        if (each.axis.size() == 0 || !values.changed(each.axis)) continue;
        each.joint.axis = values.vector(each.axis);
        each.form = JointForm(each.joint, each.links);
        each.at_rest = each.form.at(each.links.rest()).first.cwiseAbs();
        changed = true;
    }
    return changed;
}

double DamperTerm::stress_by_damping(std::size_t k, double strain) const {
    return history_.shift ? history_.scale * strain - history_.shift->number(static_cast<Index>(k), 0) : 0.0;
}

void DamperTerm::evaluate(const double* q, const Controls&, Residual& out) {
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

void DamperTerm::finish_assembly(const double*, const Controls&, SystemMatrix& out) const {
    if (!history_.shift) return;
    for (std::size_t k = 0; k < each_.size(); ++k) {
        const Each& each = each_[k];
        const JointForm::Local& now = now_[k];
        const double stress = each.damping * stress_by_damping(k, now.value);
        each.links.add(stress * now.pairs, now.first, each.damping * history_.scale, now.other,
                       stress * now.cross, out);
    }
}

void DamperTerm::vjp(const double*, const Controls&, const double* lambda, Gradient& out) {
    if (!history_.shift) return;
    const Strains along = strain_rates(lambda);
    for (std::size_t k = 0; k < each_.size(); ++k)
        out.values[each_[k].slot.first] +=
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

void DamperTerm::rates_vjp(const double* q, const double* v, const Strains& by_rates, VectorXd& by_q,
                           VectorXd& by_v) const {
    for (Index k = 0; k < elements(); ++k) {
        const JointForm::Local at = local(each_[k], q);
        each_[k].links.add_to(by_rates.number(k, 0) * at.first, by_v);
        each_[k].links.add_to(by_rates.number(k, 0) * at.second(each_[k].links.gather(v)), by_q);
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
