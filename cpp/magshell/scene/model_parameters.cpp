#include "magshell/scene/model_parameters.h"

#include <algorithm>
#include <utility>

#include "magshell/core/errors.h"
#include "magshell/terms/damped_term.h"
#include "magshell/terms/magnetic/applied_field_term.h"

namespace magshell {
namespace {

constexpr double difference =
    1e-3;  // [-] step of the differences, over the load path; see test_a_path_goes_through_the_closing_of_a_contact

}  // namespace

ModelParameters::ModelParameters(const Registry& registry, const Bodies& bodies, DofMap& dof_map,
                                 SceneTerms& terms)
    : registry_(registry), bodies_(bodies), dof_map_(dof_map), terms_(terms) {}

LoadParameters ModelParameters::zero_load_parameters() const {
    return LoadParameters::Zero(registry_.load_parameters.size() + varying_.size());
}

void ModelParameters::set_values(const VectorXd& in_user_order) {
    values_.set(registry_.values, registry_.values.to_core(in_user_order));
    distribute_values();
}

void ModelParameters::vary(TimeVaryingParameters time_varying) {
    if (varying_.empty()) base_values_ = values_.numbers();
    varying_ = std::move(time_varying);
    values_.set(registry_.values, base_values_);
    distribute_values();
}

void ModelParameters::set_time_varying(const LoadParameters& load_parameters) {
    if (varying_.empty()) return;
    VectorXd numbers = values_.numbers();
    if (!varying_.update(load_parameters, numbers)) return;
    values_.set(registry_.values, std::move(numbers));
    distribute_values();
}

void ModelParameters::distribute_values() {
    dof_map_.set_values(values_);
    terms_.field_sources.set_values(values_);
    bool cancels_otherwise = false;
    length_scale_ = bodies_.rigid_length();
    for (const std::unique_ptr<Term>& term : terms_.energies) {
        cancels_otherwise |= term->set_values(values_);
        length_scale_ = std::min(length_scale_, term->length_scale());
    }
    for (const std::unique_ptr<ForceTerm>& force : terms_.forces) force->set_values(values_);
    if (cancels_otherwise) ++cancelling_version_;
    ++version_;
}

void ModelParameters::vjp(const VectorXd& q, const LoadParameters& load_parameters, const VectorXd& lambda,
                          Gradient& out) const {
    for (const std::unique_ptr<Term>& term : terms_.energies)
        term->vjp(q.data(), load_parameters, lambda.data(), out);
}

KinematicsGradient ModelParameters::forces_vjp(const Kinematics& at, const LoadParameters& load_parameters,
                                               const VectorXd& lambda, Gradient& out) const {
    const VectorXd nothing = VectorXd::Zero(bodies_.nodes().n_dofs());
    KinematicsGradient by{nothing, nothing, zero_load_parameters()};
    for (const std::unique_ptr<ForceTerm>& force : terms_.forces)
        force->vjp(at, load_parameters, lambda, by, out);
    if (at.momentum_rate.size() == 0) return by;
    by.p_hat = at.rate * lambda;  // of the force (p^ - p)/tau
    by.time = at.rate * lambda.dot(at.momentum_rate);
    VectorXd by_q = nothing, by_v = nothing;
    momentum_vjp(at.q, at.v, by.p_hat, by_q, by_v, out);
    by.velocity -= by_v;
    return by;
}

void ModelParameters::momentum_vjp(const VectorXd& q, const VectorXd& v, const VectorXd& lambda,
                                   VectorXd& by_q, VectorXd& by_v, Gradient& out) const {
    for (const std::unique_ptr<ForceTerm>& force : terms_.forces)
        force->momentum_vjp(q, v, lambda, by_q, by_v, out);
}

void ModelParameters::damper_rates_vjp(const VectorXd& q, const VectorXd& v, const StrainSet& by_rates,
                                       VectorXd& by_q, VectorXd& by_v, Gradient& out) const {
    for (std::size_t k = 0; k < terms_.damped.size(); ++k)
        terms_.damped[k]->rates_vjp(q.data(), v.data(), by_rates.of_terms[k], by_q, by_v, out);
}

// Parameters may enter in any way, for example as the position of a magnet. Fourth-order differences lose no more digits than a gradient
// has lost already, and continuation uses them only as a predictor.
template <class Function>
VectorXd ModelParameters::rate_by_varying(const LoadParameters& at, const LoadParameters& rate,
                                          const Function& function) {
    const Index n = varying_.size();
    VectorXd sum = VectorXd::Zero(bodies_.nodes().n_dofs());
    if (rate.tail(n).isZero(0.0)) return sum;
    const auto beside = [&](double way) {
        LoadParameters there = at;
        there.tail(n) += way * rate.tail(n);
        set_time_varying(there);
        return function(there);
    };
    for (const double steps : {1.0, 2.0}) {
        const double weight = (steps == 1.0 ? 8.0 : -1.0) / (12.0 * difference);
        sum += weight * (beside(steps * difference) - beside(-steps * difference));
    }
    set_time_varying(at);
    return sum;
}

VectorXd ModelParameters::gradient_rate(const VectorXd& q, const LoadParameters& at,
                                        const LoadParameters& rate) {
    // The difference removes the part that does not depend on the load parameters, such as that of target volumes. A central one is
    // exact where the gradient is quadratic.
    const LoadParameters none = LoadParameters::Zero(rate.size());
    Residual change, constant, above, below, dropped;
    for (Residual* each : {&change, &constant, &above, &below, &dropped})
        each->reset(bodies_.nodes().n_dofs());
    for (const std::unique_ptr<Term>& term : terms_.energies) {
        if (!term->depends_on_loads()) continue;
        const AppliedFieldTerm* in_field = dynamic_cast<const AppliedFieldTerm*>(term.get());
        const bool quadratic = in_field && in_field->is_quadratic_in_loads();
        term->evaluate(q.data(), quadratic ? at + rate : rate, quadratic ? above : change);
        term->evaluate(q.data(), quadratic ? at - rate : none, quadratic ? below : constant);
        term->evaluate(q.data(), at, dropped);  // restores the state of the term
    }
    change.gradient -= constant.gradient;
    change.gradient += 0.5 * (above.gradient - below.gradient);
    if (varying_.empty()) return change.gradient;
    return change.gradient + rate_by_varying(at, rate, [&](const LoadParameters& there) {
               Residual gradient;
               gradient.reset(bodies_.nodes().n_dofs());
               for (const std::unique_ptr<Term>& term : terms_.energies)
                   if (term->varies()) term->evaluate(q.data(), there, gradient);
               return gradient.gradient;
           });
}

VectorXd ModelParameters::prescribed_rate(const VectorXd& q, const LoadParameters& at,
                                          const LoadParameters& rate) {
    const VectorXd held = dof_map_.support_factor(rate) * dof_map_.prescribed_rate(at);
    if (varying_.empty()) return held;
    return held + rate_by_varying(at, rate, [&](const LoadParameters& there) {
               return dof_map_.prescribed_increment(q, there);
           });
}

TimeVaryingParameters::TimeVaryingParameters(const Registry& registry, const std::vector<Index>& entries)
    : first_(registry.load_parameters.size()) {
    for (const Index k : entries) {
        if (k < 0 || k >= static_cast<Index>(registry.values.entries().size()))
            throw InvalidInput("the scene has no value of number " + std::to_string(k));
        const Parameters::Entry& entry = registry.values.entries()[k];
        if (entry.order)
            throw InvalidInput(entry.name + " of " + entry.owner +
                               " cannot change during a solve, because it has one row per vertex or face");
        slices_.push_back(entry.slice);
        size_ += entry.slice.size();
    }
}

bool TimeVaryingParameters::update(const LoadParameters& load_parameters, VectorXd& values) const {
    bool changed = false;
    Index from = first_;
    for (const ParameterSlice& slice : slices_) {
        const auto now = load_parameters.segment(from, slice.size());
        if (values.segment(slice.first, slice.size()) != now) {
            values.segment(slice.first, slice.size()) = now;
            changed = true;
        }
        from += slice.size();
    }
    return changed;
}

void TimeVaryingParameters::move_gradient(Gradient& gradient) const {
    Index to = first_;
    for (const ParameterSlice& slice : slices_) {
        gradient.load_parameters.segment(to, slice.size()) +=
            gradient.values.segment(slice.first, slice.size());
        gradient.values.segment(slice.first, slice.size()).setZero();
        to += slice.size();
    }
}

}  // namespace magshell
