#include "magshell/scene/model.h"

#include <algorithm>
#include <cmath>
#include <utility>

#include "magshell/assembly/hessian_operator.h"
#include "magshell/core/errors.h"
#include "magshell/dofs/skeleton_coordinates.h"
#include "magshell/linalg/krylov/operator_factor.h"
#include "magshell/linalg/low_rank_factor.h"
#include "magshell/scene/scene_input.h"
#include "magshell/terms/damped_term.h"
#include "magshell/terms/low_rank_term.h"
#include "magshell/terms/operator_term.h"

namespace magshell {
namespace {

// Converts the nodes of supports from the numbering of the caller: vertices of bodies first, then directions.
std::vector<PrescribedNode> renumbered(std::vector<PrescribedNode> prescribed, const Bodies& bodies) {
    const Nodes& nodes = bodies.nodes();
    for (PrescribedNode& each : prescribed)
        each.node = each.node < bodies.n_body_vertices()
                        ? nodes.vertices.core[each.node]
                        : nodes.direction_node(each.node - bodies.n_body_vertices());
    return prescribed;
}

std::vector<TiedDof> renumbered(std::vector<TiedDof> tied, const Nodes& nodes) {
    const auto core = [&](Index dof) { return 3 * nodes.vertices.core[dof / 3] + dof % 3; };
    for (TiedDof& each : tied) {
        each.dof = core(each.dof);
        for (TiedDof::Part& part : each.parts) part.dof = core(part.dof);
    }
    return tied;
}

// Returns the reduced coordinates of skeletons, then of rigid bodies that belong to none, then ties of displacements.
ReducedCoordinatesList reduced_coordinates_of(const Bodies& bodies, const SceneInput& input,
                                              Registry& registry) {
    const auto link = [&](Index part) {
        return RigidNodes(bodies.rigid_nodes()[part], bodies.n_own(part), bodies.nodes().rest);
    };
    std::vector<char> joined(bodies.rigid_nodes().size(), 0);
    ReducedCoordinatesList all;
    for (const SkeletonInput& skeleton : input.skeletons) {
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
            const JointKind::Traits& kind = joint.traits();
            if (!kind.has_origin) continue;
            if (joint.has_motor) slices[k].motor = add(kind.motor.name, kind.motor.unit, kind.freedom);
            slices[k].origin = add("origin", "m", 3);
            if (kind.has_axis) slices[k].axis = add("axis", "1", 3);
            slices[k].numbers = joint.add_numbers(skeleton.labels[k], registry.values);
        }
        all.push_back(
            std::make_unique<SkeletonCoordinates>(std::move(links), skeleton.joints, std::move(slices)));
    }
    for (Index part = 0; part < static_cast<Index>(joined.size()); ++part)
        if (!joined[part])
            all.push_back(
                std::make_unique<SkeletonCoordinates>(std::vector{link(part)}, std::vector<Joint>(1)));
    if (!input.tied.empty())
        all.push_back(
            std::make_unique<LinearTies>(renumbered(input.tied, bodies.nodes()), bodies.nodes().n_dofs()));
    return all;
}

}  // namespace

Model::Model(const SceneInput& input)
    : bodies_(input),
      matrix_(nodes().n_nodes(), nodes().scalars, bodies_.stencils(input), bodies_.cliques()),
      dof_map_(matrix_, renumbered(input.held, bodies_), nodes(), input.moves, registry_,
               reduced_coordinates_of(bodies_, input, registry_)),
      terms_(input, bodies_, matrix_, registry_),
      parameters_(registry_, bodies_, dof_map_, terms_),
      capabilities_(terms_, dof_map_, nodes(), low_rank_),
      metric_(bodies_.area_metric()),
      extent_(bodies_.extent()),
      rest_reach_(bodies_.reach()) {
    if (!terms_.operators.empty() && !terms_.low_rank.empty())
        throw InvalidInput("own_field cannot be combined with cavities, cells or tendons yet");
    assign_columns();
}

Model::~Model() = default;

NodeMatrix Model::projective_stiffness() const {
    NodeMatrix sum(nodes().n_nodes(), nodes().scalars);
    for (const std::unique_ptr<Term>& term : terms_.energies)
        if (!term->add_projective_stiffness(sum))
            throw InvalidInput("Projective Dynamics does not support the " + std::string(term->name()) +
                               " energy of this scene: choose another integrator");
    sum.finish();
    return sum;
}

VectorXd Model::contact_stiffness_diagonal() const {
    VectorXd of_nodes = VectorXd::Zero(nodes().n_nodes());
    for (const std::unique_ptr<Term>& term : terms_.energies) term->add_contact_stiffness(of_nodes);
    return of_nodes;
}

// Positions far from the origin have larger round-off. The largest coordinate is rounded up to a power of two, so that most states share
// the forces computed once.
VectorXd Model::cancelling_forces(const VectorXd& q) {
    const double reach = q.head(n_coordinates()).lpNorm<Eigen::Infinity>();
    double beyond = 0.0;
    if (std::isfinite(reach) && reach > 2.0 * rest_reach_)
        beyond = std::exp2(std::ceil(std::log2(reach / rest_reach_))) * rest_reach_;
    if (cancelling_version_ != parameters_.cancelling_version() || beyond != beyond_) {
        cancelling_version_ = parameters_.cancelling_version();
        beyond_ = beyond;
        cancelling_forces_ = VectorXd::Zero(size());
        for (const std::unique_ptr<Term>& term : terms_.energies)
            term->add_cancelling_forces(beyond, cancelling_forces_);
    }
    VectorXd forces = terms_.elastic.scale() * cancelling_forces_;
    for (const DampedTerm* term : terms_.damped) term->add_cancelling_stage_forces(beyond_, forces);
    return forces;
}

StrainSet Model::damper_rates(const VectorXd& q, const VectorXd& v) const {
    StrainSet rates;
    for (const DampedTerm* term : terms_.damped) rates.of_terms.push_back(term->rates(q.data(), v.data()));
    return rates;
}

std::shared_ptr<Factor> Model::new_factor(const std::function<void()>& watch) {
    return factors_.get(dof_map_.pattern(), [&] {
        std::unique_ptr<Factor> analysed =
            analyze(dof_map_.pattern(), {.points = free_points(), .watch = watch});
        if (!terms_.low_rank.empty()) analysed = std::make_unique<LowRankFactor>(std::move(analysed));
        if (!terms_.operators.empty()) analysed = std::make_unique<OperatorFactor>(std::move(analysed));
        return analysed;
    });
}

void Model::store_spare_factor(std::shared_ptr<Factor> factor) {
    factors_.store(std::move(factor));
}

double Model::energy(const VectorXd& q, const LoadParameters& load_parameters) const {
    double total = 0.0;
    for (const std::unique_ptr<Term>& term : terms_.energies)
        total += term->energy(q.data(), load_parameters);
    return total;
}

std::vector<std::string_view> Model::term_names() const {
    std::vector<std::string_view> names;
    for (const std::unique_ptr<Term>& term : terms_.energies) names.push_back(term->name());
    return names;
}

std::vector<std::pair<std::string_view, double>> Model::energies(
    const VectorXd& q, const LoadParameters& load_parameters) const {
    std::vector<std::pair<std::string_view, double>> of_terms;
    for (const std::unique_ptr<Term>& term : terms_.energies)
        of_terms.emplace_back(term->name(), term->energy(q.data(), load_parameters));
    return of_terms;
}

double Model::field_sampling_error(const VectorXd& q, const LoadParameters& load_parameters) {
    double largest = 0.0;
    for (const std::unique_ptr<Term>& term : terms_.energies) {
        const double error = term->field_sampling_error(q.data(), load_parameters, extent_);
        if (!(error <= largest)) largest = error;
        if (std::isnan(largest)) break;
    }
    return largest;
}

void Model::evaluate(const VectorXd& q, const LoadParameters& load_parameters) {
    dof_map_.linearize(q);
    residual_.reset(size());
    for (const std::unique_ptr<Term>& term : terms_.energies)
        term->evaluate(q.data(), load_parameters, residual_);
}

std::string Model::not_finite(const VectorXd& q, const LoadParameters& load_parameters) {
    if (std::string reason = capabilities_.invalid_state_reason(q); !reason.empty()) return reason;
    Residual residual;
    for (const std::unique_ptr<Term>& term : terms_.energies) {
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
    for (LowRankTerm* term : terms_.low_rank) term->take_extrapolated(extrapolated_stress, project_psd);
    for (const std::unique_ptr<Term>& term : terms_.energies) {
        term->set_psd_projection(project_psd);
        term->prepare_assembly(q.data(), load_parameters);
    }
    update_contact_pattern();
    terms_.coloring.scatter([&](const ElementBlock& element_block) {
        clear(element_block.number);
        for (const Term* term : terms_.of_body[element_block.body])
            term->assemble(element_block, q.data(), load_parameters, extrapolated_stress, matrix_);
    });
    for (const std::unique_ptr<Term>& term : terms_.energies)
        term->finish_assembly(q.data(), load_parameters, matrix_);
    low_rank_.clear();
    for (const LowRankTerm* term : terms_.low_rank) term->add_low_rank(load_parameters, low_rank_);
    operators_.clear();
    for (const OperatorTerm* term : terms_.operators)
        if (std::shared_ptr<const HessianOperator> each = term->hessian_operator(q.data(), load_parameters))
            operators_.push_back(std::move(each));
    collect_nonsymmetric_tangent(q, load_parameters);
}

void Model::update_contact_pattern() {
    const std::int64_t coupled =
        terms_.contact_layer && terms_.contact_layer->used() ? terms_.contact_layer->version() : 0;
    if (coupled == coupled_) return;
    dof_map_.set_pattern(matrix_, coupled > 0 ? &terms_.contact_layer->matrix() : nullptr);
    coupled_ = coupled;
}

VectorXd Model::contact_forces(const VectorXd& q, const LoadParameters& load_parameters) const {
    Residual residual;
    residual.reset(size());
    terms_.contacts.evaluate(q, kinematics_, load_parameters, residual);
    return -residual.gradient;
}

VectorXd Model::multiply_contact_transposed(const VectorXd& q, const LoadParameters& load_parameters,
                                            const VectorXd& x) {
    matrix_.clear_columns(0, matrix_.size());
    low_rank_.clear();
    nonsymmetric_.clear();
    operators_.clear();  // the matrix is that of contact alone until the next assembly
    terms_.contacts.assemble(q, kinematics_, load_parameters, matrix_, nonsymmetric_);
    update_contact_pattern();
    VectorXd product(size());
    multiply(x, product);
    nonsymmetric_.add_product(x, true, product);
    return product;
}

SystemMatrix* Model::contact_matrix() {
    return coupled_ > 0 ? &terms_.contact_layer->matrix() : nullptr;
}

void Model::multiply(const VectorXd& x, VectorXd& out) const {
    matrix_.multiply(x.data(), out.data());
    if (coupled_ > 0) terms_.contact_layer->matrix().add_product(x.data(), out.data());
    low_rank_.add_product(x, out);
    for (const std::shared_ptr<const HessianOperator>& each : operators_) each->add_product(x, out);
}

VectorXd Model::diagonal() const {
    VectorXd sum = VectorXd::Zero(size());
    matrix_.add_diagonal(sum);
    if (coupled_ > 0) terms_.contact_layer->matrix().add_diagonal(sum);
    low_rank_.add_diagonal(sum);
    return sum;
}

void Model::reduce_matrix(LargeVector<double>& values) {
    dof_map_.matrix(matrix_, contact_matrix(), values);
}

void Model::reduce_matrix(Factor& factor) {
    reduce_matrix(factor.values());
    if (!terms_.low_rank.empty())
        static_cast<LowRankFactor&>(factor).set_low_rank(low_rank_.reduced(dof_map_, size()),
                                                         low_rank_.stiffness());
    if (terms_.operators.empty()) return;
    static_cast<OperatorFactor&>(factor).set_operator(operator_product(false), operator_product(true),
                                                      !dof_map_.has_reduced_coordinates());
}

std::function<VectorXd(const VectorXd&)> Model::operator_product(bool rough) const {
    if (operators_.empty()) return {};
    return [this, rough, operators = operators_](const VectorXd& x) {
        const VectorXd full = dof_map_.expand(x);
        VectorXd image = VectorXd::Zero(full.size());
        for (const std::shared_ptr<const HessianOperator>& each : operators)
            if (const auto* quick = dynamic_cast<const RoughHessianOperator*>(each.get()); quick && rough)
                quick->add_rough_product(full, image);
            else
                each->add_product(full, image);
        return dof_map_.vector(image);
    };
}

bool Model::operators_are_rough() const {
    return std::any_of(operators_.begin(), operators_.end(), [](const auto& each) {
        const auto* const quick = dynamic_cast<const RoughHessianOperator*>(each.get());
        return quick && quick->is_rough();
    });
}

// Finds the columns that each element block clears before it assembles: those of its own nodes that no earlier block has. The last entry has
// the columns that no block touches.
void Model::assign_columns() {
    const std::vector<ElementBlock> element_blocks = terms_.coloring.in_order();
    std::vector<bool> taken(matrix_.size(), false);
    first_columns_.resize(element_blocks.size() + 1);
    std::vector<Index> columns;
    const auto take = [&](Index first, Index count) {
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
                if (node >= 0) take(3 * node, 3);
            for (const Index r : body.scalars_of(element))
                if (r >= 0) take(3 * matrix_.nodes() + r, 1);
        }
        hand_over(first_columns_[element_block.number]);
    }
    take(0, 3 * matrix_.nodes());
    hand_over(first_columns_.back());
}

void Model::extrapolate(const VectorXd& p) {
    for (const std::unique_ptr<Term>& term : terms_.energies) term->extrapolate(p.data());
}

Model::AngleBranches Model::angle_branches() const {
    AngleBranches angle_branches;
    for (const std::unique_ptr<Term>& term : terms_.energies)
        angle_branches.push_back(term->angle_branches());
    return angle_branches;
}

void Model::set_angle_branches(const AngleBranches& angle_branches) {
    bool fits = angle_branches.empty() || angle_branches.size() == terms_.energies.size();
    for (std::size_t k = 0; fits && k < angle_branches.size(); ++k)
        fits = angle_branches[k].size() == terms_.energies[k]->angle_branches().size();
    if (!fits)
        throw InvalidInput(
            "`start` belongs to another scene: the numbers of its accumulated rotations do not fit the "
            "joints and "
            "edge moments of this scene. Pass its positions (n_v, 3) to use its shape only, such as "
            "start=trajectory.positions[-1]");
    for (std::size_t k = 0; k < terms_.energies.size(); ++k)
        terms_.energies[k]->set_angle_branches(
            angle_branches.empty() ? std::vector<double>(terms_.energies[k]->angle_branches().size(), 0.0)
                                   : angle_branches[k]);
}

std::size_t Model::bytes() const {
    return matrix_.bytes() + dof_map_.bytes() + terms_.bytes();
}

void Model::collect_nonsymmetric_tangent(const VectorXd& q, const LoadParameters& load_parameters) {
    nonsymmetric_.clear();
    unsymmetric_ = false;
    if (!capabilities_.has_unsymmetric_tangent) return;
    for (const std::unique_ptr<Term>& term : terms_.energies)
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
    if (std::none_of(terms_.energies.begin(), terms_.energies.end(),
                     [](const auto& term) { return term->name() == "pressure"; }))
        throw InvalidInput(
            "the torque of a Ball or of a rigid body has no potential, so the stiffness is not symmetric. "
            "Equilibria, paths, "
            "motions and their gradients "
            "can be computed; vibrations and buckling loads cannot: use torques of Revolute joints instead");
    throw InvalidInput(
        "the pressure has no potential, so the stiffness is not symmetric: its faces end at a free border, "
        "or neighbouring "
        "faces have different pressures. Equilibria, paths, motions and their gradients can be "
        "computed; vibrations and buckling loads "
        "cannot: close the surface, hold its border, or give one pressure to all of it");
}

void Model::require_sparse() const {
    if (operators_.empty()) return;
    throw InvalidInput(
        "the own field couples all magnetized vertices, so the stiffness is not a sparse matrix. Equilibria, "
        "paths, motions by "
        "time steps, vibrations, buckling loads, linear responses and their gradients can be computed with "
        "own_field; Hessians as matrices cannot: leave own_field out of the scene for these");
}

VectorXd Model::term_gradient(std::string_view name, const VectorXd& q,
                              const LoadParameters& load_parameters) {
    Residual sum;
    sum.reset(size());
    for (const std::unique_ptr<Term>& term : terms_.energies)
        if (term->name() == name) term->evaluate(q.data(), load_parameters, sum);
    return sum.gradient;
}

void Model::begin_step(const VectorXd& q, const LoadParameters& load_parameters) {
    for (const std::unique_ptr<ForceTerm>& force : terms_.forces) force->begin_step(q, load_parameters);
}

void Model::evaluate_forces(const VectorXd& q, const LoadParameters& load_parameters,
                            const StageMotion& stage) {
    if (terms_.forces.empty()) return;
    const Index coordinates = n_coordinates();
    kinematics_.q = q;
    kinematics_.rate = 1.0 / stage.time;
    kinematics_.v.setZero(size());
    kinematics_.v.head(coordinates) = kinematics_.rate * (q - *stage.x_hat).head(coordinates);
    kinematics_.momentum_rate.resize(0);
    if (may_have_fluid_momentum()) {
        kinematics_.momentum_rate = kinematics_.rate * (fluid_momentum(q, kinematics_.v) - *stage.p_hat);
        residual_.gradient += kinematics_.momentum_rate;
        residual_.magnitude += kinematics_.momentum_rate.cwiseAbs();
    }
    for (const std::unique_ptr<ForceTerm>& force : terms_.forces)
        force->evaluate(kinematics_, load_parameters, residual_);
}

bool Model::may_have_fluid_momentum() const {
    return std::any_of(terms_.forces.begin(), terms_.forces.end(),
                       [](const auto& force) { return force->may_have_fluid_momentum(); });
}

VectorXd Model::fluid_momentum(const VectorXd& q, const VectorXd& v) const {
    if (!may_have_fluid_momentum()) return {};
    VectorXd momentum = VectorXd::Zero(size());
    for (const std::unique_ptr<ForceTerm>& force : terms_.forces) force->add_momentum(q, v, momentum);
    return momentum;
}

double Model::fluid_energy(const VectorXd& q, const VectorXd& v, VectorXd* by_q) const {
    double sum = 0.0;
    for (const std::unique_ptr<ForceTerm>& force : terms_.forces) sum += force->fluid_energy(q, v, by_q);
    return sum;
}

std::vector<PairStiffness> Model::contact_pair_stiffness() const {
    std::vector<PairStiffness> pairs;
    if (!capabilities_.has_barrier) return pairs;
    terms_.contacts.add_pair_stiffness(pairs);
    for (const std::unique_ptr<ForceTerm>& force : terms_.forces) force->add_stiffness(kinematics_, pairs);
    return pairs;
}

void Model::add_cancelling_forces_here(bool in_motion, VectorXd& out) const {
    for (const LowRankTerm* term : terms_.low_rank) term->add_cancelling_here(out);
    terms_.contacts.add_cancelling_normal_forces(out);
    if (!in_motion) return;
    for (const std::unique_ptr<ForceTerm>& force : terms_.forces)
        force->add_cancelling_forces(kinematics_, out);
}

void Model::freeze_normal_forces(bool held) {
    for (const std::unique_ptr<ForceTerm>& force : terms_.forces) force->set_frozen(held);
}

void Model::assemble_forces(const LoadParameters& load_parameters, bool project_psd) {
    if (terms_.forces.empty()) return;
    const std::size_t before = nonsymmetric_.skew_blocks().size();
    for (const std::unique_ptr<ForceTerm>& force : terms_.forces)
        force->assemble(kinematics_, load_parameters, project_psd, matrix_, nonsymmetric_);
    unsymmetric_ = unsymmetric_ || nonsymmetric_.has_rate_forces() || skew_blocks_act(before);
}

}  // namespace magshell
