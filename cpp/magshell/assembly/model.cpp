#include "magshell/assembly/model.h"

#include <algorithm>
#include <cmath>
#include <utility>

#include "magshell/assembly/friction_term.h"
#include "magshell/core/errors.h"
#include "magshell/strain/fold_angle.h"

namespace magshell {
namespace {

std::vector<Stencil> all_stencils(const Sheet& sheet, const SceneInput& input) {
    std::vector<Stencil> stencils = sheet.stencils;
    for (const EdgeCoupleInput& couple : input.couples) {
        const Index user_face = input.mesh.edge_faces().row(couple.edge).maxCoeff();
        const Index f = sheet.faces.core[user_face];
        Stencil s;
        for (int k = 0; k < 3; ++k) s.nodes[k] = sheet.corners[f][k];
        s.nodes[3] = sheet.direction_node(couple.direction);
        stencils.push_back(s);
    }
    return stencils;
}

std::vector<HeldNode> renumbered(std::vector<HeldNode> held, const Sheet& sheet) {
    for (HeldNode& h : held)
        if (h.node < sheet.n_vertices()) h.node = sheet.vertices.core[h.node];
    return held;
}

std::vector<SheetMaterial> renumbered(const std::vector<SheetMaterial>& materials, const Sheet& sheet) {
    std::vector<SheetMaterial> ours;
    ours.reserve(materials.size());
    for (const Index user : sheet.faces.user) ours.push_back(materials[user]);
    return ours;
}

VectorXd node_forces(const Rows3& vertex_loads, const Sheet& sheet) {
    VectorXd forces = VectorXd::Zero(3 * sheet.n_nodes());
    for (Index v = 0; v < sheet.n_vertices(); ++v)
        forces.segment<3>(3 * v) = vertex_loads.row(sheet.vertices.user[v]).transpose();
    return forces;
}

VectorXd area_metric(const Sheet& sheet) {
    VectorXd metric = VectorXd::Zero(sheet.n_unknowns());
    for (const std::array<Index, 3>& c : sheet.corners) {
        const Vec3 a = sheet.rest[c[1]] - sheet.rest[c[0]], b = sheet.rest[c[2]] - sheet.rest[c[0]];
        for (const Index node : c) metric.segment<3>(3 * node).array() += a.cross(b).norm() / 6.0;
    }
    return metric;
}

double extent_of(const TriangleMesh& mesh) {
    return (mesh.rest_positions().colwise().maxCoeff() - mesh.rest_positions().colwise().minCoeff()).norm();
}

}  // namespace

Model::Model(SceneInput input)
    : sheet_(input.mesh, input.directed_edges, input.directions, input.directors),
      matrix_(sheet_.n_nodes(), sheet_.n_rotations(), all_stencils(sheet_, input)),
      reduction_(matrix_, renumbered(input.held, sheet_), sheet_.rest, sheet_.n_vertices()),
      schedule_(sheet_),
      faces_(sheet_, schedule_, matrix_),
      metric_(area_metric(sheet_)),
      extent_(extent_of(input.mesh)),
      rest_reach_(input.mesh.rest_positions().lpNorm<Eigen::Infinity>()) {
    add_terms(input);
    share_out_columns();
    set_values(input.values);
}

template <class T>
T* Model::add(std::unique_ptr<T> term) {
    T* added = term.get();
    terms_.push_back(std::move(term));
    return added;
}

void Model::add_terms(const SceneInput& input) {
    const SceneValues& values = input.values;
    const VectorXd no_forces = VectorXd::Zero(3 * sheet_.n_nodes());
    membrane_ = add(std::make_unique<MembraneTerm>(sheet_, faces_));
    bending_ = add(std::make_unique<BendingTerm>(sheet_, schedule_, matrix_));
    if (input.magnetic) magnetic_ = add(std::make_unique<MagneticTerm>(sheet_, faces_));
    if (!values.gravity.isZero(0.0))
        gravity_ = add(
            std::make_unique<LoadTerm>("gravity", no_forces, &Controls::gravity, &SceneGradient::weights));
    if (values.vertex_loads.rows() > 0)
        loads_ = add(std::make_unique<LoadTerm>("loads", no_forces, &Controls::load, &SceneGradient::loads));
    if (!input.couples.empty()) add_couples(input);
    if (!input.contacts.empty()) add_contacts(input.contacts);
    if (values.water) {
        std::unique_ptr<WaterTerm> water = std::make_unique<WaterTerm>(sheet_, faces_);
        water_ = water.get();
        forces_.push_back(std::move(water));
    }
}

void Model::add_contacts(const std::vector<ContactInput>& contacts) {
    contact_ = add(std::make_unique<ContactTerm>(sheet_, matrix_, contacts));
    std::vector<bool> rubs, lagged;
    for (const ContactInput& contact : contacts) {
        rubs.push_back(contact.rubs);
        lagged.push_back(contact.lagged);
    }
    if (std::find(rubs.begin(), rubs.end(), true) != rubs.end())
        forces_.push_back(std::make_unique<FrictionTerm>(*contact_, std::move(rubs), std::move(lagged)));
}

void Model::set_values(const SceneValues& values) {
    const std::vector<SheetMaterial> materials = renumbered(values.materials, sheet_);
    thickness_.clear();
    for (const SheetMaterial& m : materials) thickness_.push_back(m.thickness);
    thinnest_ = *std::min_element(thickness_.begin(), thickness_.end());
    membrane_->set_material(materials);
    bending_->set_material(materials, values.curvature_scale);
    if (magnetic_) {
        magnetic_->set_sources(values.field_sources);
        magnetic_->set_magnetization(std::vector<Vec3>(sheet_.n_faces(), Vec3::Zero()), thickness_);
    }
    if (gravity_) gravity_->set_forces(node_forces(values.vertex_mass * values.gravity.transpose(), sheet_));
    if (loads_) loads_->set_forces(node_forces(values.vertex_loads, sheet_));
    if (couples_) couples_->set_couples(values.couples);
    if (water_) water_->set_water(values.water);
    if (contact_) contact_->set_values(values.contacts, values.obstacles);
    reduction_.set_motions(values.motions);
    cancelling_forces_.resize(0);
}

// A sheet that has fallen or flown far knows its shape less exactly. By powers of two, so that most states
// share what was computed once.
VectorXd Model::cancelling_forces(const VectorXd& q) {
    const double reach = q.head(3 * sheet_.n_vertices()).lpNorm<Eigen::Infinity>();
    double beyond = 0.0;
    if (std::isfinite(reach) && reach > 2.0 * rest_reach_)
        beyond = std::exp2(std::ceil(std::log2(reach / rest_reach_))) * rest_reach_;
    if (cancelling_forces_.size() == 0 || beyond != beyond_) {
        beyond_ = beyond;
        cancelling_forces_ = VectorXd::Zero(size());
        for (const std::unique_ptr<Term>& term : terms_)
            term->add_cancelling_forces(beyond, cancelling_forces_);
    }
    return history_scale_ * cancelling_forces_;
}

SceneGradient Model::vjp(const VectorXd& q, const Controls& controls, const VectorXd& lambda) {
    SceneGradient gradient;
    gradient.thickness = gradient.young_modulus = gradient.poisson_ratio = VectorXd::Zero(sheet_.n_faces());
    gradient.curvature_scale = VectorXd::Zero(sheet_.n_edges());
    if (magnetic_) gradient.remanent_magnetization = Rows3::Zero(sheet_.n_faces(), 3);
    if (couples_) gradient.couples = VectorXd::Zero(couples_->count());
    for (const std::unique_ptr<Term>& term : terms_) term->vjp(q.data(), controls, lambda.data(), gradient);
    return gradient;
}

void Model::set_history(double scale, const SheetStrains* shift) {
    history_scale_ = scale;
    membrane_->set_history({scale, shift ? &shift->membrane : nullptr});
    bending_->set_history({scale, shift ? &shift->bending : nullptr});
}

SheetStrains Model::strains(const VectorXd& q) {
    SheetStrains strains;
    membrane_->strains(q.data(), strains.membrane);
    bending_->strains(q.data(), strains.bending);
    return strains;
}

SheetStrains Model::strain_rates(const VectorXd& p) {
    SheetStrains rates;
    membrane_->strain_rates(p.data(), rates.membrane);
    bending_->strain_rates(p.data(), rates.bending);
    return rates;
}

VectorXd Model::strain_forces(const SheetStrains& stresses) {
    Residual forces;
    forces.reset(size());
    membrane_->add_forces(stresses.membrane, forces);
    bending_->add_forces(stresses.bending, forces);
    return std::move(forces.gradient);
}

SheetStrains Model::stresses(const SheetStrains& strains) const {
    SheetStrains stresses;
    membrane_->stresses(strains.membrane, stresses.membrane);
    bending_->stresses(strains.bending, stresses.bending);
    return stresses;
}

std::shared_ptr<Factor> Model::new_factor(const std::function<void()>& watch) {
    if (spare_) return std::exchange(spare_, nullptr);
    if (!analysed_) {
        analysed_ = analyze(reduction_.pattern(), {.points = free_points(), .watch = watch});
        ++analyses_;
    }
    return analysed_->sibling();
}

void Model::keep_spare(std::shared_ptr<Factor> factor) {
    constexpr std::size_t large = std::size_t{1} << 28;
    if (!factor || factor.use_count() > 1 || factor->bytes() > large) return;
    factor->forget();
    spare_ = std::move(factor);
}

void Model::add_couples(const SceneInput& input) {
    std::vector<CoupleTerm::Couple> couples;
    for (const EdgeCoupleInput& given : input.couples) {
        const bool forward = input.mesh.edge_faces()(given.edge, 0) != TriangleMesh::none;
        const Index f = sheet_.faces.core[input.mesh.edge_faces()(given.edge, forward ? 0 : 1)];
        int i = 0;
        while (sheet_.edges[f][i] != given.edge) ++i;
        const std::array<Index, 3>& c = sheet_.corners[f];
        const std::array<Index, 4> nodes = {c[(i + 1) % 3], c[(i + 2) % 3], c[i],
                                            sheet_.direction_node(given.direction)};
        Pack3 x[4];
        for (int k = 0; k < 4; ++k)
            for (int lane = 0; lane < Pack::width; ++lane) set_lane(x[k], lane, sheet_.rest[nodes[k]]);
        const double rest_angle = Fold(x[0], x[1], x[2], x[3], Pack(0.0)).angle()[0];
        couples.push_back(
            {nodes, rest_angle, sheet_.rotation_of_edge[given.edge], forward ? 1.0 : -1.0, 0.0});
    }
    couples_ = add(std::make_unique<CoupleTerm>(sheet_, matrix_, std::move(couples)));
}

void Model::set_magnetization(const Rows3& remanent_magnetization) {
    std::vector<Vec3> ours;
    ours.reserve(sheet_.n_faces());
    for (const Index user : sheet_.faces.user) ours.push_back(remanent_magnetization.row(user).transpose());
    magnetic_->set_magnetization(ours, thickness_);
}

VectorXd Model::rest_state() const {
    VectorXd q = VectorXd::Zero(size());
    for (Index node = 0; node < sheet_.n_nodes(); ++node) q.segment<3>(3 * node) = sheet_.rest[node];
    return q;
}

VectorXd Model::state(const Rows3& positions, const VectorXd& edge_rotations) const {
    VectorXd q = gradient_by_state(positions, edge_rotations);
    for (Index node = sheet_.n_vertices(); node < sheet_.n_nodes(); ++node)
        q.segment<3>(3 * node) = sheet_.rest[node];
    return q;
}

VectorXd Model::gradient_by_state(const Rows3& by_positions, const VectorXd& by_edge_rotations) const {
    VectorXd gradient = VectorXd::Zero(size());
    for (Index v = 0; v < sheet_.n_vertices(); ++v)
        gradient.segment<3>(3 * v) = by_positions.row(sheet_.vertices.user[v]).transpose();
    for (Index r = 0; r < sheet_.n_rotations(); ++r)
        gradient[3 * sheet_.n_nodes() + r] = by_edge_rotations[sheet_.edge_of_rotation[r]];
    return gradient;
}

VectorXd Model::vertex_weights(const VectorXd& by_vertex) const {
    VectorXd weights = VectorXd::Zero(size());
    for (Index v = 0; v < sheet_.n_vertices(); ++v)
        weights.segment<3>(3 * v).setConstant(by_vertex[sheet_.vertices.user[v]]);
    return weights;
}

Rows3 Model::positions(const VectorXd& q) const {
    Rows3 x(sheet_.n_vertices(), 3);
    for (Index v = 0; v < sheet_.n_vertices(); ++v)
        x.row(sheet_.vertices.user[v]) = q.segment<3>(3 * v).transpose();
    return x;
}

VectorXd Model::edge_rotations(const VectorXd& q) const {
    VectorXd rotations = VectorXd::Zero(sheet_.n_edges());
    for (Index r = 0; r < sheet_.n_rotations(); ++r)
        rotations[sheet_.edge_of_rotation[r]] = q[3 * sheet_.n_nodes() + r];
    return rotations;
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
    residual_.reset(size());
    for (const std::unique_ptr<Term>& term : terms_) term->evaluate(q.data(), controls, residual_);
}

std::string Model::not_finite(const VectorXd& q, const Controls& controls) {
    Residual residual;
    for (const std::unique_ptr<Term>& term : terms_) {
        residual.reset(size());
        term->evaluate(q.data(), controls, residual);
        for (Index k = 0; k < size(); ++k)
            if (!std::isfinite(residual.gradient[k])) {
                const std::string of = "the " + std::string(term->name()) + " force";
                if (k >= 3 * sheet_.n_vertices()) return of + " is not finite";
                return of + " on vertex " + std::to_string(sheet_.vertices.user[k / 3]) + " is not finite";
            }
    }
    return {};
}

void Model::assemble(const VectorXd& q, const Controls& controls, bool extrapolated_stress) {
    const auto clear = [&](std::size_t part) {
        for (const Index node : first_nodes_[part]) matrix_.clear_node(node);
        for (const Index rotation : first_rotations_[part]) matrix_.clear_rotation(rotation);
    };
    clear(first_nodes_.size() - 1);
    // All terms of a part before the next part: its share of the matrix is cleared and filled in the cache.
    for (const std::unique_ptr<Term>& term : terms_) term->prepare_assembly(q.data(), controls);
    schedule_.scatter([&](const Part& part) {
        clear(part.number);
        for (const std::unique_ptr<Term>& term : terms_)
            term->assemble(part, q.data(), controls, extrapolated_stress, matrix_);
    });
    for (const std::unique_ptr<Term>& term : terms_) term->finish_assembly(q.data(), controls, matrix_);
}

void Model::share_out_columns() {
    const std::vector<Part> parts = schedule_.in_order();
    std::vector<bool> node_taken(sheet_.n_nodes(), false), rotation_taken(sheet_.n_rotations(), false);
    first_nodes_.resize(parts.size() + 1);
    first_rotations_.resize(parts.size() + 1);
    const auto take = [](std::vector<bool>& taken, Index number, std::vector<Index>& list) {
        if (number < 0 || taken[number]) return;
        taken[number] = true;
        list.push_back(number);
    };
    for (const Part& part : parts)
        for (Index f = part.first_face; f < part.last_face; ++f) {
            for (const Index node : sheet_.stencils[f].nodes)
                take(node_taken, node, first_nodes_[part.number]);
            for (const Index r : sheet_.stencils[f].rotations)
                take(rotation_taken, r, first_rotations_[part.number]);
        }
    for (Index node = 0; node < sheet_.n_nodes(); ++node) take(node_taken, node, first_nodes_.back());
}

void Model::extrapolate(const VectorXd& p) {
    for (const std::unique_ptr<Term>& term : terms_) term->extrapolate(p.data());
}

VectorXd Model::gradient_rate(const VectorXd& q, const Controls& rate) {
    Residual change;
    change.reset(size());
    for (const std::unique_ptr<Term>& term : terms_)
        if (term->driven()) term->evaluate(q.data(), rate, change);
    return change.gradient;
}

Model::Memory Model::memory() const {
    Memory memory;
    for (const std::unique_ptr<Term>& term : terms_) memory.push_back(term->memory());
    return memory;
}

void Model::set_memory(const Memory& memory) {
    bool fits = memory.empty() || memory.size() == terms_.size();
    for (std::size_t k = 0; fits && k < memory.size(); ++k)
        fits = memory[k].size() == terms_[k]->memory().size();
    if (!fits) throw InvalidInput("the start remembers a motion of another scene: start from its positions");
    for (std::size_t k = 0; k < terms_.size(); ++k)
        terms_[k]->set_memory(memory.empty() ? std::vector<double>(terms_[k]->memory().size(), 0.0)
                                             : memory[k]);
}

std::size_t Model::bytes() const {
    std::size_t total = matrix_.bytes() + reduction_.bytes() + schedule_.bytes() + faces_.bytes();
    for (const std::unique_ptr<Term>& term : terms_) total += term->bytes();
    return total;
}

}  // namespace magshell
