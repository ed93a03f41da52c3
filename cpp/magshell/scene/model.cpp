#include "magshell/scene/model.h"

#include <algorithm>
#include <cmath>
#include <utility>

#include "magshell/assembly/skeleton_carrier.h"
#include "magshell/core/errors.h"
#include "magshell/linalg/low_rank_factor.h"
#include "magshell/scene/scene_input.h"
#include "magshell/term/body_contact_term.h"
#include "magshell/term/damper_term.h"
#include "magshell/term/low_rank_term.h"

namespace magshell {
namespace {

// Held nodes count the vertices of sheets first, then directions.
std::vector<HeldNode> renumbered(std::vector<HeldNode> held, const Bodies& bodies) {
    const Nodes& nodes = bodies.nodes();
    for (HeldNode& h : held)
        h.node = h.node < bodies.n_body_vertices() ? nodes.vertices.core[h.node]
                                                   : nodes.direction_node(h.node - bodies.n_body_vertices());
    return held;
}

// Of skeletons, then of the parts that are no links.
Carriers carriers_of(const Bodies& bodies, const std::vector<SkeletonInput>& skeletons, Registry& registry) {
    const auto link = [&](Index part) {
        return RigidNodes(bodies.rigid_nodes()[part], bodies.n_own(part), bodies.nodes().rest);
    };
    std::vector<char> joined(bodies.rigid_nodes().size(), 0);
    Carriers carriers;
    for (const SkeletonInput& skeleton : skeletons) {
        std::vector<RigidNodes> links;
        for (const Index part : skeleton.links) {
            links.push_back(link(part));
            joined[part] = 1;
        }
        std::vector<SkeletonCarrier::Slots> slots(skeleton.joints.size());
        for (std::size_t k = 0; k < slots.size(); ++k) {
            const Joint& joint = skeleton.joints[k];
            const auto add = [&](const char* name, const char* unit, Index width) {
                return registry.values.add(skeleton.labels[k], name, unit, 1, width);
            };
            if (joint.kind == JointKind::free) continue;
            if (joint.driven)
                slots[k].motor = joint.kind == JointKind::ball       ? add("motor_rotation", "rad", 3)
                                 : joint.kind == JointKind::revolute ? add("motor_angle", "SI", 1)
                                                                     : add("motor_displacement", "SI", 1);
            slots[k].origin = add("origin", "m", 3);
            if (joint.has_axis()) slots[k].axis = add("axis", "1", 3);
        }
        carriers.push_back(
            std::make_unique<SkeletonCarrier>(std::move(links), skeleton.joints, std::move(slots)));
    }
    for (Index part = 0; part < static_cast<Index>(joined.size()); ++part)
        if (!joined[part])
            carriers.push_back(
                std::make_unique<SkeletonCarrier>(std::vector{link(part)}, std::vector<Joint>(1)));
    return carriers;
}

}  // namespace

Model::Model(const SceneInput& input)
    : bodies_(input),
      matrix_(nodes().n_nodes(), nodes().scalars, bodies_.stencils(input), bodies_.cliques()),
      reduction_(matrix_, renumbered(input.held, bodies_), nodes(), input.moves, registry_,
                 carriers_of(bodies_, input.skeletons, registry_)),
      schedule_(nodes().n_nodes(), bodies_.all()),
      sources_(input.field_sources, registry_),
      of_body_(bodies_.all().size()),
      metric_(bodies_.area_metric()),
      extent_(bodies_.extent()),
      rest_reach_(bodies_.reach()) {
    // The standard controls are there in every scene, whether a term reads them or not.
    registry_.controls.add("scene", "applied_flux_density", "T", 1, 3);
    for (const char* factor : {"field_factor", "load_factor", "gravity_factor"})
        registry_.controls.add("scene", factor, "1", 1, 1);
    for (Index body = 0; body < static_cast<Index>(bodies_.sheets().size()); ++body)
        add_loops(body, input.sheets[body].curvature_scale);
    for (std::size_t k = bodies_.sheets().size(); k < bodies_.faces().size(); ++k) {
        const auto& [surface, body] = bodies_.faces()[k];
        loops_.push_back(surface ? std::make_unique<FaceLoop>(surface->corners, schedule_.of(body), matrix_)
                                 : nullptr);
    }
    add_terms(input);
    for (const std::unique_ptr<Term>& term : terms_) {
        if (term->body() >= 0) of_body_[term->body()].push_back(term.get());
        if (term->has_infeasible_states()) refusing_.push_back(term.get());
    }
    share_out_columns();
}

Model::~Model() = default;

void Model::set_values(const VectorXd& in_user_order) {
    values_.set(registry_.values, registry_.values.to_core(in_user_order));
    hand_out_values();
}

void Model::vary(Varying varying) {
    if (varying_.empty()) standing_ = values_.numbers();
    varying_ = std::move(varying);
    values_.set(registry_.values, standing_);
    hand_out_values();
}

void Model::take(const Controls& controls) {
    if (varying_.empty()) return;
    VectorXd numbers = values_.numbers();
    if (!varying_.take(controls, numbers)) return;
    values_.set(registry_.values, std::move(numbers));
    hand_out_values();
}

void Model::hand_out_values() {
    reduction_.set_values(values_);
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

NodeMatrix Model::surrogate() const {
    NodeMatrix sum(nodes().n_nodes(), nodes().scalars);
    // Dampers act on few coordinates, whose stiffness in a step secants learn.
    for (const std::unique_ptr<Term>& term : terms_)
        if (term.get() != damper_term_ && !term->add_projective_stiffness(sum))
            throw InvalidInput("Projective Dynamics has no constant matrix for the " +
                               std::string(term->name()) + " energy of this scene");
    sum.finish();
    return sum;
}

VectorXd Model::touching_stiffness() const {
    VectorXd of_nodes = VectorXd::Zero(nodes().n_nodes());
    for (const std::unique_ptr<Term>& term : terms_) term->add_contact_stiffness(of_nodes);
    return of_nodes;
}

// A sheet that has fallen or flown far knows its shape less exactly. By powers of two, so that most states
// share what was computed once.
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

void Model::vjp(const VectorXd& q, const Controls& controls, const VectorXd& lambda, Gradient& out) {
    for (const std::unique_ptr<Term>& term : terms_) term->vjp(q.data(), controls, lambda.data(), out);
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

const ElasticTerm& Model::elastic_term(Index sheet, std::string_view name) const {
    const std::vector<ElasticTerm*>& all = elastic_.all();
    const auto found = std::find_if(all.begin(), all.end(), [&](const ElasticTerm* term) {
        return term->body() == sheet && term->name() == name;
    });
    return **found;
}

std::shared_ptr<Factor> Model::new_factor(const std::function<void()>& watch) {
    return factors_.get(reduction_.pattern(), [&] {
        std::unique_ptr<Factor> analysed =
            analyze(reduction_.pattern(), {.points = free_points(), .watch = watch});
        if (!borders_.empty()) analysed = std::make_unique<LowRankFactor>(std::move(analysed));
        return analysed;
    });
}

void Model::keep_spare(std::shared_ptr<Factor> factor) {
    factors_.store(std::move(factor));
}

double Model::energy(const VectorXd& q, const Controls& controls) const {
    double total = 0.0;
    for (const std::unique_ptr<Term>& term : terms_) total += term->energy(q.data(), controls);
    return total;
}

std::vector<std::string_view> Model::term_names() const {
    std::vector<std::string_view> names;
    for (const std::unique_ptr<Term>& term : terms_) names.push_back(term->name());
    return names;
}

std::vector<std::pair<std::string_view, double>> Model::energies(const VectorXd& q,
                                                                 const Controls& controls) const {
    std::vector<std::pair<std::string_view, double>> of_terms;
    for (const std::unique_ptr<Term>& term : terms_)
        of_terms.emplace_back(term->name(), term->energy(q.data(), controls));
    return of_terms;
}

void Model::evaluate(const VectorXd& q, const Controls& controls) {
    reduction_.linearize(q);
    residual_.reset(size());
    for (const std::unique_ptr<Term>& term : terms_) term->evaluate(q.data(), controls, residual_);
}

std::string Model::not_finite(const VectorXd& q, const Controls& controls) {
    if (std::string reason = refusal(q); !reason.empty()) return reason;
    Residual residual;
    for (const std::unique_ptr<Term>& term : terms_) {
        residual.reset(size());
        term->evaluate(q.data(), controls, residual);
        for (Index k = 0; k < size(); ++k)
            if (!std::isfinite(residual.gradient[k])) {
                const std::string of = "the " + std::string(term->name()) + " force";
                if (k >= n_coordinates()) return of + " is not finite";
                return of + " on vertex " + std::to_string(nodes().user_vertex(k / 3)) + " is not finite";
            }
    }
    return {};
}

void Model::assemble(const VectorXd& q, const Controls& controls, bool extrapolated_stress, bool cautious) {
    const auto clear = [&](std::size_t chunk) {
        for (const auto& [first, last] : first_columns_[chunk]) matrix_.clear_columns(first, last);
    };
    clear(first_columns_.size() - 1);
    // All terms of a chunk before the next chunk: its share of the matrix is cleared and filled in the cache.
    for (LowRankTerm* term : borders_) term->take_extrapolated(extrapolated_stress, cautious);
    for (const std::unique_ptr<Term>& term : terms_) {
        term->set_psd_projection(cautious);
        term->prepare_assembly(q.data(), controls);
    }
    if (const std::int64_t coupled = layer_ && layer_->used() ? layer_->version() : 0; coupled != coupled_) {
        reduction_.set_pattern(matrix_, coupled > 0 ? &layer_->matrix() : nullptr);
        coupled_ = coupled;
    }
    schedule_.scatter([&](const Chunk& chunk) {
        clear(chunk.number);
        for (const Term* term : of_body_[chunk.body])
            term->assemble(chunk, q.data(), controls, extrapolated_stress, matrix_);
    });
    for (const std::unique_ptr<Term>& term : terms_) term->finish_assembly(q.data(), controls, matrix_);
    low_rank_.clear();
    for (const LowRankTerm* term : borders_) term->add_low_rank(controls, low_rank_);
    add_remainders(q, controls);
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
    reduction_.matrix(matrix_, contact_matrix(), values);
}

void Model::reduce_matrix(Factor& factor) {
    reduce_matrix(factor.values());
    if (!borders_.empty())
        static_cast<LowRankFactor&>(factor).set_low_rank(low_rank_.reduced(reduction_, size()),
                                                         low_rank_.stiffness());
}

void Model::share_out_columns() {
    const std::vector<Chunk> chunks = schedule_.in_order();
    std::vector<bool> taken(matrix_.size(), false);
    first_columns_.resize(chunks.size() + 1);
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
    for (const Chunk& chunk : chunks) {
        const Body& body = *bodies_.all()[chunk.body];
        for (Index element = chunk.first; element < chunk.last; ++element) {
            for (const Index node : body.nodes_of(element))
                if (node >= 0) take(3 * node, 3);
            for (const Index r : body.scalars_of(element))
                if (r >= 0) take(3 * matrix_.nodes() + r, 1);
        }
        hand_over(first_columns_[chunk.number]);
    }
    take(0, 3 * matrix_.nodes());
    hand_over(first_columns_.back());
}

double Model::largest_share(const VectorXd& q, const VectorXd& p) const {
    double share = 1.0;
    for (const Term* term : refusing_) share = std::min(share, term->max_step_length(q.data(), p.data()));
    return share;
}

bool Model::touches() const {
    return body_contact_ && !body_contact_->evaluated_contacts().empty();
}

std::string Model::refusal(const VectorXd& q) const {
    for (const Term* term : refusing_)
        if (std::string reason = term->invalid_state_reason(q.data()); !reason.empty()) return reason;
    return {};
}

double Model::share_of_step(const VectorXd& q, const VectorXd& p) const {
    constexpr double of_way = 0.8, shortest = 1e-12;
    if (!refuses_states()) return 1.0;
    double share = largest_share(q, p / of_way);
    if (!reduction_.carries()) return share;
    for (; share > shortest; share *= 0.5) {  // what is carried moves along a curve
        VectorXd there = q;
        reduction_.advance(there, share * p);
        if (largest_share(q, there - q) >= 1.0) return share;
    }
    return 0.0;
}

std::string Model::stuck(const VectorXd& q, const VectorXd& p) const {
    const double share = largest_share(q, p);
    if (body_contact_ && body_contact_->max_step_length(q.data(), p.data()) <= share)
        return "bodies cannot follow: " + body_contact_->blocking(q.data(), p.data());
    return "elements cannot follow: " + refusal(q + 1.01 * share * p);
}

void Model::extrapolate(const VectorXd& p) {
    for (const std::unique_ptr<Term>& term : terms_) term->extrapolate(p.data());
}

Model::Turns Model::turns() const {
    Turns turns;
    for (const std::unique_ptr<Term>& term : terms_) turns.push_back(term->angle_branches());
    return turns;
}

void Model::set_turns(const Turns& turns) {
    bool fits = turns.empty() || turns.size() == terms_.size();
    for (std::size_t k = 0; fits && k < turns.size(); ++k)
        fits = turns[k].size() == terms_[k]->angle_branches().size();
    if (!fits) throw InvalidInput("the start remembers a motion of another scene: start from its positions");
    for (std::size_t k = 0; k < terms_.size(); ++k)
        terms_[k]->set_angle_branches(
            turns.empty() ? std::vector<double>(terms_[k]->angle_branches().size(), 0.0) : turns[k]);
}

std::size_t Model::bytes() const {
    std::size_t total = matrix_.bytes() + reduction_.bytes() + schedule_.bytes();
    for (const std::unique_ptr<FaceLoop>& loop : loops_) total += loop ? loop->bytes() : 0;
    for (std::size_t k = 0; k < membrane_faces_.size(); ++k)
        total += membrane_faces_[k]->bytes() + (membrane_loops_[k] ? membrane_loops_[k]->bytes() : 0);
    for (const std::unique_ptr<Term>& term : terms_) total += term->bytes();
    return total;
}

}  // namespace magshell
