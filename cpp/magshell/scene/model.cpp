#include "magshell/scene/model.h"

#include <algorithm>
#include <cmath>
#include <utility>

#include "magshell/core/errors.h"
#include "magshell/dofs/skeleton_coordinates.h"
#include "magshell/linalg/low_rank_factor.h"
#include "magshell/scene/scene_input.h"
#include "magshell/terms/joint/damper_term.h"
#include "magshell/terms/low_rank_term.h"

namespace magshell {
namespace {

constexpr double difference =
    1e-3;  // [-] step of the differences, over the load path; see test_a_path_goes_through_the_closing_of_a_contact

// Converts the nodes of supports from the numbering of the caller: vertices of bodies first, then directions.
std::vector<PrescribedNode> renumbered(std::vector<PrescribedNode> held, const Bodies& bodies) {
    const Nodes& nodes = bodies.nodes();
    for (PrescribedNode& h : held)
        h.node = h.node < bodies.n_body_vertices() ? nodes.vertices.core[h.node]
                                                   : nodes.direction_node(h.node - bodies.n_body_vertices());
    return held;
}

// Returns the reduced coordinates of skeletons, then of rigid bodies that belong to none.
ReducedCoordinatesList reduced_coordinates_of(const Bodies& bodies,
                                              const std::vector<SkeletonInput>& skeletons,
                                              Registry& registry) {
    const auto link = [&](Index part) {
        return RigidNodes(bodies.rigid_nodes()[part], bodies.n_own(part), bodies.nodes().rest);
    };
    std::vector<char> joined(bodies.rigid_nodes().size(), 0);
    ReducedCoordinatesList all;
    for (const SkeletonInput& skeleton : skeletons) {
        std::vector<RigidNodes> links;
        for (const Index part : skeleton.links) {
            links.push_back(link(part));
            joined[part] = 1;
        }
        std::vector<SkeletonCoordinates::ParameterSlices> slices(skeleton.joints.size());
        for (std::size_t k = 0; k < slices.size(); ++k) {
            const Joint& joint = skeleton.joints[k];
            const auto add = [&](const char* name, const char* unit, Index width) {
                return registry.values.add(skeleton.labels[k], name, unit, 1, width);
            };
            if (joint.kind == JointKind::free) continue;
            if (joint.has_motor)
                slices[k].motor = joint.kind == JointKind::ball       ? add("motor_rotation", "rad", 3)
                                  : joint.kind == JointKind::revolute ? add("motor_angle", "SI", 1)
                                                                      : add("motor_displacement", "SI", 1);
            slices[k].origin = add("origin", "m", 3);
            if (joint.has_axis()) slices[k].axis = add("axis", "1", 3);
        }
        all.push_back(
            std::make_unique<SkeletonCoordinates>(std::move(links), skeleton.joints, std::move(slices)));
    }
    for (Index part = 0; part < static_cast<Index>(joined.size()); ++part)
        if (!joined[part])
            all.push_back(
                std::make_unique<SkeletonCoordinates>(std::vector{link(part)}, std::vector<Joint>(1)));
    return all;
}

}  // namespace

Model::Model(const SceneInput& input)
    : bodies_(input),
      matrix_(nodes().n_nodes(), nodes().scalars, bodies_.stencils(input), bodies_.cliques()),
      dof_map_(matrix_, renumbered(input.held, bodies_), nodes(), input.moves, registry_,
               reduced_coordinates_of(bodies_, input.skeletons, registry_)),
      coloring_(nodes().n_nodes(), bodies_.all()),
      sources_(input.field_sources, registry_),
      of_body_(bodies_.all().size()),
      metric_(bodies_.area_metric()),
      extent_(bodies_.extent()),
      rest_reach_(bodies_.reach()) {
    // These load parameters exist in every scene, whether a term reads them or not.
    registry_.load_parameters.add("scene", "applied_flux_density", "T", 1, 3);
    for (const char* factor : {"field_factor", "load_factor", "gravity_factor"})
        registry_.load_parameters.add("scene", factor, "1", 1, 1);
    for (Index body = 0; body < static_cast<Index>(bodies_.shells().size()); ++body)
        add_loops(body, input.shells[body].curvature_scale);
    for (std::size_t k = bodies_.shells().size(); k < bodies_.faces().size(); ++k) {
        const auto& [surface, body] = bodies_.faces()[k];
        loops_.push_back(surface ? std::make_unique<FaceLoop>(surface->corners, coloring_.of(body), matrix_)
                                 : nullptr);
    }
    add_terms(input);
    for (const std::unique_ptr<Term>& term : terms_) {
        if (term->body() >= 0) of_body_[term->body()].push_back(term.get());
        const Capabilities own = term->capabilities();
        capabilities_ |= own;
        if (own.has_infeasible_states) restricting_terms_.push_back(term.get());
    }
    capabilities_.has_velocity_forces = !forces_.empty();
    assign_columns();
}

Model::~Model() = default;

void Model::set_values(const VectorXd& in_user_order) {
    values_.set(registry_.values, registry_.values.to_core(in_user_order));
    distribute_values();
}

void Model::vary(TimeVaryingParameters time_varying) {
    if (varying_.empty()) base_values_ = values_.numbers();
    varying_ = std::move(time_varying);
    values_.set(registry_.values, base_values_);
    distribute_values();
}

void Model::set_time_varying(const LoadParameters& load_parameters) {
    if (varying_.empty()) return;
    VectorXd numbers = values_.numbers();
    if (!varying_.update(load_parameters, numbers)) return;
    values_.set(registry_.values, std::move(numbers));
    distribute_values();
}

void Model::distribute_values() {
    dof_map_.set_values(values_);
    sources_.set_values(values_);
    bool cancels_otherwise = false;
    length_scale_ = bodies_.rigid_length();
    for (const std::unique_ptr<Term>& term : terms_) {
        cancels_otherwise |= term->set_values(values_);
        length_scale_ = std::min(length_scale_, term->length_scale());
    }
    for (const std::unique_ptr<ForceTerm>& force : forces_) force->set_values(values_);
    if (cancels_otherwise) cancelling_forces_.resize(0);
    ++values_version_;
}

NodeMatrix Model::projective_stiffness() const {
    NodeMatrix sum(nodes().n_nodes(), nodes().scalars);
    // Dampers act on few coordinates, whose stiffness in a step L-BFGS learns.
    for (const std::unique_ptr<Term>& term : terms_)
        if (term.get() != damper_term_ && !term->add_projective_stiffness(sum))
            throw InvalidInput("Projective Dynamics does not support the " + std::string(term->name()) +
                               " energy of this scene: choose another integrator");
    sum.finish();
    return sum;
}

VectorXd Model::contact_stiffness_diagonal() const {
    VectorXd of_nodes = VectorXd::Zero(nodes().n_nodes());
    for (const std::unique_ptr<Term>& term : terms_) term->add_contact_stiffness(of_nodes);
    return of_nodes;
}

// Positions far from the origin have larger round-off. They are rounded up to powers of two, so that most states share the forces
// computed once.
VectorXd Model::cancelling_forces(const VectorXd& q) {
    const double reach = q.head(n_coordinates()).lpNorm<Eigen::Infinity>();
    double beyond = 0.0;
    if (std::isfinite(reach) && reach > 2.0 * rest_reach_)
        beyond = std::exp2(std::ceil(std::log2(reach / rest_reach_))) * rest_reach_;
    if (cancelling_forces_.size() == 0 || beyond != beyond_) {
        beyond_ = beyond;
        cancelling_forces_ = VectorXd::Zero(size());
        for (const std::unique_ptr<Term>& term : terms_)
            term->add_cancelling_forces(beyond, cancelling_forces_);
    }
    VectorXd forces = elastic_.scale() * cancelling_forces_;
    if (damper_term_) damper_term_->add_cancelling_stage_forces(beyond_, forces);
    return forces;
}

void Model::vjp(const VectorXd& q, const LoadParameters& load_parameters, const VectorXd& lambda,
                Gradient& out) {
    for (const std::unique_ptr<Term>& term : terms_) term->vjp(q.data(), load_parameters, lambda.data(), out);
}

StrainSet Model::damper_rates(const VectorXd& q, const VectorXd& v) const {
    StrainSet rates;
    if (damper_term_) rates.of_terms.push_back(damper_term_->rates(q.data(), v.data()));
    return rates;
}

void Model::damper_rates_vjp(const VectorXd& q, const VectorXd& v, const StrainSet& by_rates, VectorXd& by_q,
                             VectorXd& by_v, Gradient& out) const {
    if (damper_term_) damper_term_->rates_vjp(q.data(), v.data(), by_rates.of_terms.front(), by_q, by_v, out);
}

const ElasticTerm& Model::elastic_term(Index shell, std::string_view name) const {
    const std::vector<ElasticTerm*>& all = elastic_.all();
    const auto found = std::find_if(all.begin(), all.end(), [&](const ElasticTerm* term) {
        return term->body() == shell && term->name() == name;
    });
    return **found;
}

std::shared_ptr<Factor> Model::new_factor(const std::function<void()>& watch) {
    return factors_.get(dof_map_.pattern(), [&] {
        std::unique_ptr<Factor> analysed =
            analyze(dof_map_.pattern(), {.points = free_points(), .watch = watch});
        if (!borders_.empty()) analysed = std::make_unique<LowRankFactor>(std::move(analysed));
        return analysed;
    });
}

void Model::store_spare_factor(std::shared_ptr<Factor> factor) {
    factors_.store(std::move(factor));
}

double Model::energy(const VectorXd& q, const LoadParameters& load_parameters) const {
    double total = 0.0;
    for (const std::unique_ptr<Term>& term : terms_) total += term->energy(q.data(), load_parameters);
    return total;
}

std::vector<std::string_view> Model::term_names() const {
    std::vector<std::string_view> names;
    for (const std::unique_ptr<Term>& term : terms_) names.push_back(term->name());
    return names;
}

std::vector<std::pair<std::string_view, double>> Model::energies(
    const VectorXd& q, const LoadParameters& load_parameters) const {
    std::vector<std::pair<std::string_view, double>> of_terms;
    for (const std::unique_ptr<Term>& term : terms_)
        of_terms.emplace_back(term->name(), term->energy(q.data(), load_parameters));
    return of_terms;
}

void Model::evaluate(const VectorXd& q, const LoadParameters& load_parameters) {
    dof_map_.linearize(q);
    residual_.reset(size());
    for (const std::unique_ptr<Term>& term : terms_) term->evaluate(q.data(), load_parameters, residual_);
}

std::string Model::not_finite(const VectorXd& q, const LoadParameters& load_parameters) {
    if (std::string reason = invalid_state_reason(q); !reason.empty()) return reason;
    Residual residual;
    for (const std::unique_ptr<Term>& term : terms_) {
        residual.reset(size());
        term->evaluate(q.data(), load_parameters, residual);
        for (Index k = 0; k < size(); ++k)
            if (!std::isfinite(residual.gradient[k])) {
                const std::string of = "the " + std::string(term->name()) + " force";
                if (k >= n_coordinates()) return of + " is not finite";
                return of + " on vertex " + std::to_string(nodes().user_vertex(k / 3)) + " is not finite";
            }
    }
    return {};
}

void Model::assemble(const VectorXd& q, const LoadParameters& load_parameters, bool extrapolated_stress,
                     bool project_psd) {
    const auto clear = [&](std::size_t element_block) {
        for (const auto& [first, last] : first_columns_[element_block]) matrix_.clear_columns(first, last);
    };
    clear(first_columns_.size() - 1);
    // Assembles all terms of a block before the next block, while its part of the matrix is in the cache.
    for (LowRankTerm* term : borders_) term->take_extrapolated(extrapolated_stress, project_psd);
    for (const std::unique_ptr<Term>& term : terms_) {
        term->set_psd_projection(project_psd);
        term->prepare_assembly(q.data(), load_parameters);
    }
    if (const std::int64_t coupled = layer_ && layer_->used() ? layer_->version() : 0; coupled != coupled_) {
        dof_map_.set_pattern(matrix_, coupled > 0 ? &layer_->matrix() : nullptr);
        coupled_ = coupled;
    }
    coloring_.scatter([&](const ElementBlock& element_block) {
        clear(element_block.number);
        for (const Term* term : of_body_[element_block.body])
            term->assemble(element_block, q.data(), load_parameters, extrapolated_stress, matrix_);
    });
    for (const std::unique_ptr<Term>& term : terms_)
        term->finish_assembly(q.data(), load_parameters, matrix_);
    low_rank_.clear();
    for (const LowRankTerm* term : borders_) term->add_low_rank(load_parameters, low_rank_);
    collect_nonsymmetric_tangent(q, load_parameters);
}

SystemMatrix* Model::contact_matrix() {
    return coupled_ > 0 ? &layer_->matrix() : nullptr;
}

void Model::multiply(const VectorXd& x, VectorXd& out) const {
    matrix_.multiply(x.data(), out.data());
    if (coupled_ > 0) layer_->matrix().add_product(x.data(), out.data());
    low_rank_.add_product(x, out);
}

VectorXd Model::diagonal() const {
    VectorXd sum = VectorXd::Zero(size());
    matrix_.add_diagonal(sum);
    if (coupled_ > 0) layer_->matrix().add_diagonal(sum);
    low_rank_.add_diagonal(sum);
    return sum;
}

void Model::reduce_matrix(LargeVector<double>& values) {
    dof_map_.matrix(matrix_, contact_matrix(), values);
}

void Model::reduce_matrix(Factor& factor) {
    reduce_matrix(factor.values());
    if (!borders_.empty())
        static_cast<LowRankFactor&>(factor).set_low_rank(low_rank_.reduced(dof_map_, size()),
                                                         low_rank_.stiffness());
}

void Model::assign_columns() {
    const std::vector<ElementBlock> element_blocks = coloring_.in_order();
    std::vector<bool> taken(matrix_.size(), false);
    first_columns_.resize(element_blocks.size() + 1);
    std::vector<Index> columns;
    const auto set_time_varying = [&](Index first, Index count) {
        for (Index column = first; column < first + count; ++column) {
            if (!taken[column]) columns.push_back(column);
            taken[column] = true;
        }
    };
    const auto hand_over = [&](std::vector<std::array<Index, 2>>& runs) {
        std::sort(columns.begin(), columns.end());
        for (const Index column : columns)
            if (!runs.empty() && runs.back()[1] == column)
                ++runs.back()[1];
            else
                runs.push_back({column, column + 1});
        columns.clear();
    };
    for (const ElementBlock& element_block : element_blocks) {
        const Body& body = *bodies_.all()[element_block.body];
        for (Index element = element_block.first; element < element_block.last; ++element) {
            for (const Index node : body.nodes_of(element))
                if (node >= 0) set_time_varying(3 * node, 3);
            for (const Index r : body.scalars_of(element))
                if (r >= 0) set_time_varying(3 * matrix_.nodes() + r, 1);
        }
        hand_over(first_columns_[element_block.number]);
    }
    set_time_varying(0, 3 * matrix_.nodes());
    hand_over(first_columns_.back());
}

double Model::max_step_length(const VectorXd& q, const VectorXd& p) const {
    double length = 1.0;
    for (const Term* term : restricting_terms_)
        length = std::min(length, term->max_step_length(q.data(), p.data()));
    return length;
}

std::string Model::invalid_state_reason(const VectorXd& q) const {
    for (const Term* term : restricting_terms_)
        if (std::string reason = term->invalid_state_reason(q.data()); !reason.empty()) return reason;
    return {};
}

double Model::admissible_step_length(const VectorXd& q, const VectorXd& p) const {
    constexpr double safety =
        0.8;  // [-] part of the distance to the first invalid state; see test_ball_falls_onto_a_sheet_and_never_through
    constexpr double shortest = 1e-12;  // [-] see test_a_body_squeezed_until_it_cannot_move
    if (!capabilities_.has_infeasible_states) return 1.0;
    double length = max_step_length(q, p / safety);
    if (!dof_map_.has_reduced_coordinates()) return length;
    for (; length > shortest; length *= 0.5) {  // reduced nodes move along curves
        VectorXd there = q;
        dof_map_.retract(there, length * p);
        if (max_step_length(q, there - q) >= 1.0) return length;
    }
    return 0.0;
}

std::string Model::describe_blocked_step(const VectorXd& q, const VectorXd& p) const {
    const double length = max_step_length(q, p);
    if (std::string reason = contacts_.describe_blocking(q, p, length); !reason.empty()) return reason;
    constexpr double beyond = 1.01;  // [-] just past the limit
    return "elements block the step: " + invalid_state_reason(q + beyond * length * p);
}

void Model::extrapolate(const VectorXd& p) {
    for (const std::unique_ptr<Term>& term : terms_) term->extrapolate(p.data());
}

Model::AngleBranches Model::angle_branches() const {
    AngleBranches angle_branches;
    for (const std::unique_ptr<Term>& term : terms_) angle_branches.push_back(term->angle_branches());
    return angle_branches;
}

void Model::set_angle_branches(const AngleBranches& angle_branches) {
    bool fits = angle_branches.empty() || angle_branches.size() == terms_.size();
    for (std::size_t k = 0; fits && k < angle_branches.size(); ++k)
        fits = angle_branches[k].size() == terms_[k]->angle_branches().size();
    if (!fits)
        throw InvalidInput(
            "`start` belongs to another scene: the numbers of its accumulated rotations do not fit the "
            "joints and "
            "edge moments of this scene. Pass its positions (n_v, 3) to use its shape only, such as "
            "start=trajectory.positions[-1]");
    for (std::size_t k = 0; k < terms_.size(); ++k)
        terms_[k]->set_angle_branches(angle_branches.empty()
                                          ? std::vector<double>(terms_[k]->angle_branches().size(), 0.0)
                                          : angle_branches[k]);
}

std::size_t Model::bytes() const {
    std::size_t total = matrix_.bytes() + dof_map_.bytes() + coloring_.bytes();
    for (const std::unique_ptr<FaceLoop>& loop : loops_) total += loop ? loop->bytes() : 0;
    for (std::size_t k = 0; k < membrane_faces_.size(); ++k)
        total += membrane_faces_[k]->bytes() + (membrane_loops_[k] ? membrane_loops_[k]->bytes() : 0);
    for (const std::unique_ptr<Term>& term : terms_) total += term->bytes();
    return total;
}

void Model::collect_nonsymmetric_tangent(const VectorXd& q, const LoadParameters& load_parameters) {
    nonsymmetric_.clear();
    unsymmetric_ = false;
    if (!capabilities_.has_unsymmetric_tangent) return;
    for (const std::unique_ptr<Term>& term : terms_)
        term->add_nonsymmetric_tangent(q.data(), load_parameters, nonsymmetric_);
    unsymmetric_ = skew_blocks_act(0);
}

bool Model::skew_blocks_act(std::size_t from) const {
    return std::any_of(nonsymmetric_.skew_blocks().begin() + static_cast<std::ptrdiff_t>(from),
                       nonsymmetric_.skew_blocks().end(), [&](const NonsymmetricTangent::SkewBlock& each) {
                           return dof_map_.acts_on_free_motion(each.nodes[0], each.nodes[1], each.axis);
                       });
}

void Model::require_symmetric() const {
    if (!unsymmetric_) return;
    if (std::none_of(terms_.begin(), terms_.end(),
                     [](const auto& term) { return term->name() == "pressure"; }))
        throw InvalidInput(
            "the torque of a Ball has no potential, so the stiffness is not symmetric. Equilibria, motions "
            "and their gradients "
            "can be computed; vibrations, buckling loads and followed paths cannot: use torques of Revolute "
            "joints instead");
    throw InvalidInput(
        "the pressure has no potential, so the stiffness is not symmetric: its faces end at a free border, "
        "or neighbouring "
        "faces have different pressures. Equilibria, motions and their gradients can be computed; "
        "vibrations, buckling loads "
        "and followed paths cannot: close the surface, hold its border, or give one pressure to all of it");
}

void Model::begin_step(const VectorXd& q, const LoadParameters& load_parameters) {
    for (const std::unique_ptr<ForceTerm>& force : forces_) force->begin_step(q, load_parameters);
}

std::string Model::crossing_reason(const VectorXd& q, const LoadParameters& load_parameters,
                                   const VectorXd& end, const LoadParameters& load_parameters_at_end) const {
    const Index node = contacts_.first_crossing(q, load_parameters, end, load_parameters_at_end);
    if (node < 0) return {};
    return "vertex " + std::to_string(nodes().user_vertex(node)) +
           " passes through an obstacle within a step";
}

void Model::evaluate_forces(const VectorXd& q, const LoadParameters& load_parameters,
                            const StageMotion& stage) {
    if (forces_.empty()) return;
    const Index coordinates = n_coordinates();
    kinematics_.q = q;
    kinematics_.rate = 1.0 / stage.time;
    kinematics_.v.setZero(size());
    kinematics_.w.setZero(size());
    kinematics_.v.head(coordinates) = kinematics_.rate * (q - *stage.x_hat).head(coordinates);
    kinematics_.w.head(coordinates) = kinematics_.rate * (kinematics_.v - *stage.v_hat).head(coordinates);
    for (const std::unique_ptr<ForceTerm>& force : forces_)
        force->evaluate(kinematics_, load_parameters, residual_);
}

std::vector<PairStiffness> Model::contact_pair_stiffness() const {
    std::vector<PairStiffness> pairs;
    if (!capabilities_.has_barrier) return pairs;
    contacts_.add_pair_stiffness(pairs);
    for (const std::unique_ptr<ForceTerm>& force : forces_) force->add_stiffness(kinematics_, pairs);
    return pairs;
}

void Model::add_cancelling_forces_here(bool in_motion, VectorXd& out) const {
    for (const LowRankTerm* term : borders_) term->add_cancelling_here(out);
    contacts_.add_cancelling_normal_forces(out);
    if (!in_motion) return;
    for (const std::unique_ptr<ForceTerm>& force : forces_) force->add_cancelling_forces(kinematics_, out);
}

void Model::freeze_normal_forces(bool held) {
    for (const std::unique_ptr<ForceTerm>& force : forces_) force->set_frozen(held);
}

void Model::assemble_forces(const LoadParameters& load_parameters, bool project_psd) {
    if (forces_.empty()) return;
    const std::size_t before = nonsymmetric_.skew_blocks().size();
    for (const std::unique_ptr<ForceTerm>& force : forces_)
        force->assemble(kinematics_, load_parameters, project_psd, matrix_, nonsymmetric_);
    unsymmetric_ = unsymmetric_ || nonsymmetric_.has_rate_forces() || skew_blocks_act(before);
}

KinematicsGradient Model::forces_vjp(const LoadParameters& load_parameters, const VectorXd& lambda,
                                     Gradient& out) const {
    KinematicsGradient by{VectorXd::Zero(size()), VectorXd::Zero(size()), VectorXd::Zero(size()),
                          zero_load_parameters()};
    for (const std::unique_ptr<ForceTerm>& force : forces_)
        force->vjp(kinematics_, load_parameters, lambda, by, out);
    return by;
}

// Parameters may enter in any way, for example as the position of a magnet. Fourth-order differences lose no more digits than a gradient
// has lost already, and continuation uses them only as a predictor.
template <class Function>
VectorXd Model::rate_by_varying(const LoadParameters& at, const LoadParameters& rate,
                                const Function& function) {
    const Index n = varying_.size();
    VectorXd sum = VectorXd::Zero(size());
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

VectorXd Model::gradient_rate(const VectorXd& q, const LoadParameters& at, const LoadParameters& rate) {
    // The difference removes the part that does not depend on the load parameters, such as that of target volumes.
    const LoadParameters none = LoadParameters::Zero(rate.size());
    Residual change, constant, dropped;
    for (Residual* each : {&change, &constant, &dropped}) each->reset(size());
    for (const std::unique_ptr<Term>& term : terms_) {
        if (!term->depends_on_loads()) continue;
        term->evaluate(q.data(), rate, change);
        term->evaluate(q.data(), none, constant);
        term->evaluate(q.data(), at, dropped);  // restores the state of the term
    }
    change.gradient -= constant.gradient;
    if (varying_.empty()) return change.gradient;
    return change.gradient + rate_by_varying(at, rate, [&](const LoadParameters& there) {
               Residual gradient;
               gradient.reset(size());
               for (const std::unique_ptr<Term>& term : terms_)
                   if (term->varies()) term->evaluate(q.data(), there, gradient);
               return gradient.gradient;
           });
}

VectorXd Model::prescribed_rate(const VectorXd& q, const LoadParameters& at, const LoadParameters& rate) {
    const VectorXd held = dof_map_.support_factor(rate) * dof_map_.prescribed_rate(at);
    if (varying_.empty()) return held;
    return held + rate_by_varying(at, rate, [&](const LoadParameters& there) {
               return dof_map_.prescribed_increment(q, there);
           });
}

}  // namespace magshell
