#include "magshell/adjoint/motion_derivatives.h"

#include <algorithm>
#include <array>
#include <cmath>

#include "magshell/core/errors.h"
#include "magshell/solve/linear_response.h"

namespace magshell {
namespace {

// [-] First step of differences along a motion, of the shortest edge. See test_tangents_of_motions_agree_with_gradients_in_every_kind.
constexpr double first_fraction = 1.0 / 64.0;

VectorXd numbers_of(const StrainSet& strains) {
    std::vector<double> numbers;
    for (const Strains& part : strains.of_terms)
        for (Index element = 0; element < part.elements; ++element)
            for (int i = 0; i < part.width; ++i) numbers.push_back(part.number(element, i));
    return Eigen::Map<const VectorXd>(numbers.data(), static_cast<Index>(numbers.size()));
}

StrainSet strains_of(const VectorXd& numbers, StrainSet strains) {
    Index at = 0;
    for (Strains& part : strains.of_terms)
        for (Index element = 0; element < part.elements; ++element)
            for (int i = 0; i < part.width; ++i) part.set(element, i, numbers[at++]);
    return strains;
}

}  // namespace

VectorXd joined(std::initializer_list<VectorXd> parts) {
    Index size = 0;
    for (const VectorXd& part : parts) size += part.size();
    VectorXd all(size);
    Index at = 0;
    for (const VectorXd& part : parts) {
        all.segment(at, part.size()) = part;
        at += part.size();
    }
    return all;
}

double largest(const VectorXd& of) {
    return of.size() > 0 ? of.lpNorm<Eigen::Infinity>() : 0.0;
}

MotionDerivatives::MotionDerivatives(Model& model, const VectorXd& values,
                                     const TimeVaryingParameters& varying, const MotionInputTangent& along)
    : model_(model),
      values_(values),
      varying_(varying),
      along_(along),
      reshapes_(static_cast<bool>(along.model_at)),
      values_change_(reshapes_ || !along.values.isZero(0.0)),
      unit_(VectorXd::Ones(model.size())) {
    unit_.tail(model.size() - model.n_coordinates()).setConstant(1.0 / along.length);
    find_changing_forces();
}

void MotionDerivatives::find_changing_forces() {
    if (reshapes_) return;
    try {
        changing_.emplace(model_, values_, values_change_ ? values_at(along_.first_step) : values_);
    } catch (const InvalidInput&) {  // beyond the range of a value: all may change
    }
}

Model& MotionDerivatives::set(double t, const LoadParameters& load_parameters) {
    Model& there = reshaped_at(t);
    if (&there != &model_) {
        there.set_angle_branches(model_.angle_branches());
        there.elastic().set_history(model_.elastic().scale(), elastic_shift_);
        there.dampers().set_history(model_.dampers().scale(), dampers_shift_);
    } else if (values_change_) {
        model_.parameters().set_values(values_at(t));
    }
    there.parameters().set_time_varying(load_parameters);
    return there;
}

Model& MotionDerivatives::reshaped_at(double t) {
    if (t == 0.0 || !reshapes_) return model_;
    Reshaped& there = reshaped_[t];
    if (!there.model) {
        there.model = &along_.model_at(t);
        there.varying = std::make_unique<ScopedTimeVarying>(there.model->parameters(), varying_);
    }
    return *there.model;
}

// Positions grow little during a motion: twice the reach of a state serves many.
double MotionDerivatives::cancelling(const VectorXd& q) {
    const double reach = largest(q.head(model_.n_coordinates()));
    if (reach <= reach_) return cancelling_;
    reach_ = 2.0 * reach;
    return cancelling_ = largest(unit_.cwiseProduct(model_.cancelling_forces(q)));
}

VectorXd MotionDerivatives::values_at(double t) {
    if (t == 0.0) return values_;
    if (!along_.values_at) return values_ + t * along_.values;
    const auto known = known_values_.find(t);
    return known != known_values_.end() ? known->second : known_values_[t] = along_.values_at(t);
}

double MotionDerivatives::step_along(std::initializer_list<std::pair<double, double>> sizes_and_rates) const {
    double step = along_.first_step;
    for (const auto& [size, rate] : sizes_and_rates)
        if (rate > 0.0 && size > 0.0) step = std::min(step, first_fraction * size / rate);
    return step;
}

VectorXd MotionDerivatives::energy_gradient(const VectorXd& q, const LoadParameters& load_parameters,
                                            const LoadParameters& tangent) {
    if (!values_change_ && tangent.isZero(0.0)) return VectorXd::Zero(q.size());
    const VectorXd found = energy_.of(
        [&](double t) {
            const LoadParameters at = load_parameters + t * tangent;
            Model& there = set(t, at);
            there.evaluate(q, at);
            return VectorXd(unit_.cwiseProduct(there.residual().gradient));
        },
        along_.first_step, 0.0, "the force on the start");
    set(0.0, load_parameters);
    model_.evaluate(q, load_parameters);
    return found.cwiseQuotient(unit_);
}

StrainSet MotionDerivatives::strains(ViscousTerms& terms, const VectorXd& q, const VectorXd& motion,
                                     const LoadParameters& load_parameters, const LoadParameters& tangent) {
    StrainSet found = terms.rates(motion);
    const Index varying = model_.parameters().time_varying().size();
    if (!values_change_ && tangent.tail(varying).isZero(0.0)) return found;
    const VectorXd by_inputs = strains_.of(
        [&](double t) {
            Model& there = set(t, load_parameters + t * tangent);
            return numbers_of((&terms == &model_.dampers() ? there.dampers() : there.elastic()).strains(q));
        },
        along_.first_step, 1.0, "a strain");
    set(0.0, load_parameters);
    found.add(1.0, strains_of(by_inputs, terms.zeros()));
    return found;
}

void MotionDerivatives::set_stage(const StageTangent& stage) {
    model_.parameters().set_time_varying(stage.load_parameters);
    model_.set_angle_branches(stage.angle_branches);
    begin_step(model_, stage, 0.0);
}

// Begins the step again, with the contact forces of its beginning, which have no factor.
void MotionDerivatives::begin_step(Model& model, const StageTangent& stage, double t) {
    model.contacts().set_factor(1.0);
    model.begin_step(stage.record.begin.q + t * stage.q_begin_tangent, stage.begin + t * stage.begin_tangent);
    model.contacts().set_factor(stage.contact_factor);
}

ForceTangent MotionDerivatives::forces(const StageTangent& stage, const VectorXd& q, bool with_contact) {
    const Index size = q.size();
    const bool moving = model_.capabilities().has_velocity_forces;
    ForceTangent found{VectorXd::Zero(size), with_contact ? VectorXd::Zero(size) : VectorXd()};
    if (!moving && !values_change_ && stage.tangent.isZero(0.0)) return found;
    const auto forces = [&](double t) {
        const LoadParameters at = stage.load_parameters + t * stage.tangent;
        Model& there = set(t, at);
        there.set_angle_branches(stage.angle_branches);
        if (moving) begin_step(there, stage, t);
        there.contacts().set_factor(stage.contact_factor);
        const VectorXd x_hat = stage.x_hat + t * stage.x_hat_tangent,
                       p_hat = stage.p_hat + t * stage.p_hat_tangent;
        const StageMotion motion{&x_hat, &p_hat, stage.T + t * stage.T_tangent};
        VectorXd gradient;
        if (changing_ && !moving) {
            gradient = changing_->at(q, at);
        } else {
            there.evaluate(q, at);
            there.evaluate_forces(q, at, motion);
            gradient = there.residual().gradient;
        }
        gradient.array() *= unit_.array();
        return with_contact ? joined({gradient, unit_.cwiseProduct(there.contact_forces(q, at))}) : gradient;
    };
    double step = along_.first_step;
    if (moving)
        step = step_along({{along_.length, largest(stage.q_begin_tangent)},
                           {along_.length, largest(stage.x_hat_tangent)},
                           {stage.T, std::abs(stage.T_tangent)}});
    // Each step makes models in other rest shapes: powers of two let many stages share them.
    if (reshapes_) step = std::exp2(std::floor(std::log2(step)));
    const double noise = values_change_ ? cancelling(q) : 0.0;
    const std::array<Index, 1> ends{size};
    const VectorXd all =
        forces_.of(forces, with_contact ? std::span<const Index>(ends) : std::span<const Index>(), step,
                   std::array{noise, noise}, "a force");
    found.gradient = all.head(size).cwiseQuotient(unit_);
    if (with_contact) found.contact = all.tail(size).cwiseQuotient(unit_);
    set(0.0, stage.load_parameters);
    set_stage(stage);
    return found;
}

PrescribedTangent MotionDerivatives::prescribed(const StageTangent& stage, const VectorXd& q,
                                                const VectorXd& gradient) {
    const DofMap& dof_map = model_.dof_map();
    const bool changes = values_change_ || !stage.tangent.isZero(0.0);
    if (!changes || !(dof_map.has_values() || reshapes_)) return {};
    const bool joints = dof_map.has_reduced_coordinates() && (values_change_ || reshapes_);
    const auto target = [&](double t) {
        const LoadParameters at = stage.load_parameters + t * stage.tangent;
        Model& there = set(t, at);
        if (!joints) return there.dof_map().prescribed_increment(q, at);
        const StateOnJoints carried = state_on_joints(there, q, at, gradient);
        return joined({carried.moved, carried.driven, carried.forces});
    };
    const Index n = q.size();
    const std::array<Index, 2> ends{n, 2 * n};
    const VectorXd all =
        prescribed_.of(target, joints ? std::span<const Index>(ends) : std::span<const Index>(),
                       along_.first_step, std::array{model_.extent(), model_.extent(), largest(gradient)},
                       "the place of a support, motor or joint");
    set(0.0, stage.load_parameters);
    model_.linearize(q);
    if (!joints) return {VectorXd::Zero(n), all, {}};
    return {all.head(n), all.segment(n, n), all.tail(all.size() - 2 * n)};
}

VectorXd MotionDerivatives::fluid_momentum(const VectorXd& q, const VectorXd& v, const VectorXd& q_tangent,
                                           const VectorXd& v_tangent, const LoadParameters& load_parameters,
                                           const LoadParameters& tangent) {
    if (!model_.may_have_fluid_momentum()) return {};
    const VectorXd found = momentum_.of(
        [&](double t) {
            const Model& there = set(t, load_parameters + t * tangent);
            return there.fluid_momentum(q + t * q_tangent, v + t * v_tangent);
        },
        step_along({{along_.length, largest(q_tangent)}, {largest(v), largest(v_tangent)}}), 0.0,
        "the momentum of water");
    set(0.0, load_parameters);
    return found;
}

StrainSet MotionDerivatives::damper_rates(const MotionState& begin, const VectorXd& q_tangent,
                                          const VectorXd& v_tangent, const LoadParameters& load_parameters,
                                          const LoadParameters& tangent) {
    const StrainSet zero = model_.dampers().zeros();
    if (!model_.capabilities().has_own_viscosity) return zero;
    const VectorXd found = dampers_.of(
        [&](double t) {
            const Model& there = set(t, load_parameters + t * tangent);
            return numbers_of(there.damper_rates(begin.q + t * q_tangent, begin.v + t * v_tangent));
        },
        step_along({{along_.length, largest(q_tangent)}, {largest(begin.v), largest(v_tangent)}}), 0.0,
        "the rate of a joint");
    set(0.0, load_parameters);
    return strains_of(found, zero);
}

}  // namespace magshell
