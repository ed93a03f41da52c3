#include "magshell/terms/magnetic/own_field_term.h"

#include <mutex>
#include <string>

#include "magshell/assembly/hessian_operator.h"
#include "magshell/core/errors.h"

namespace magshell {
namespace {

std::vector<OwnField::RigidNodes> rigid_nodes_of(const std::vector<OwnFieldTerm::Magnet>& magnets) {
    std::vector<OwnField::RigidNodes> rigid;
    for (const OwnFieldTerm::Magnet& magnet : magnets) rigid.push_back({magnet.nodes});
    return rigid;
}

}  // namespace

class OwnFieldTerm::Hessian final : public RoughHessianOperator {
  public:
    Hessian(std::shared_ptr<const OwnField> field, const State& state, double factor,
            std::shared_ptr<const Product> known)
        : field_(std::move(field)),
          q_(state.q),
          near_(state.near),
          factor_(factor),
          known_(known && known->q == q_ ? std::move(known) : nullptr) {}

    void add_product(const VectorXd& x, VectorXd& y) const override {
        if (known_ && x == known_->direction)
            y += factor_ * known_->image;
        else
            add(near_, x, y);
    }
    void add_rough_product(const VectorXd& x, VectorXd& y) const override {
        std::call_once(has_rough_, [this] { rough_ = field_->rough(q_.data(), near_); });
        add(rough_, x, y);
    }
    bool is_rough() const override { return field_->has_rough_products(); }

  private:
    void add(const OwnField::Neighbours& near, const VectorXd& x, VectorXd& y) const {
        VectorXd product = VectorXd::Zero(y.size());
        field_->add_hessian_product(q_.data(), near, x.data(), product.data());
        y += factor_ * product;
    }

    std::shared_ptr<const OwnField> field_;
    VectorXd q_;
    OwnField::Neighbours near_;
    double factor_;
    std::shared_ptr<const Product> known_;  // nullptr if none is known
    mutable std::once_flag has_rough_;
    mutable OwnField::Neighbours rough_;
};

OwnFieldTerm::OwnFieldTerm(Sources sources, Index max_points, double accuracy, const Nodes& nodes,
                           Registry& registry)
    : sheets_(std::move(sources.sheets)),
      solids_(std::move(sources.solids)),
      magnets_(std::move(sources.magnets)),
      max_points_(max_points),
      n_dofs_(nodes.n_dofs()),
      factor_(registry.load_parameters.add("scene", "own_field_factor", "1", 1, 1)),
      field_(triangles_of(sheets_), triangles_of(solids_), rigid_nodes_of(magnets_)),
      sources_(std::make_shared<const OwnField>(field_)) {
    field_.set_accuracy(accuracy);
    for (const SheetTriangles& sheet : sheets_) {
        magnetization_.push_back(registry.values.add(sheet.owner(), "remanent_magnetization", "A/m",
                                                     sheet.n_faces(), 3, &sheet.faces()));
        thickness_.push_back(
            registry.values.add(sheet.owner(), "thickness", "m", sheet.n_faces(), 1, &sheet.faces()));
    }
    for (const auto& [solid, law] : solids_)
        of_solids_.push_back(registry.values.add(solid->owner, "remanent_magnetization", "A/m",
                                                 solid->n_elements(), 3, &solid->elements));
    for (const Magnet& magnet : magnets_) {
        corners_.emplace_back(
            std::array<Index, 4>{magnet.nodes[0], magnet.nodes[1], magnet.nodes[2], magnet.nodes[3]}, nodes);
        moment_.push_back(registry.values.add(magnet.owner, "magnetic_moment", "A m2", 1, 3));
        center_.push_back(registry.values.add(magnet.owner, "center", "m", 1, 3));
    }
}

bool OwnFieldTerm::set_values(const Values& values) {
    bool changed = false;
    for (std::size_t k = 0; k < sheets_.size(); ++k)
        changed |= values.changed(magnetization_[k], thickness_[k]);
    for (const ParameterSlice& magnetization : of_solids_) changed |= values.changed(magnetization);
    for (std::size_t k = 0; k < magnets_.size(); ++k) changed |= values.changed(moment_[k], center_[k]);
    if (!changed) return false;
    product_.reset();
    magnetizations_.clear();
    thicknesses_.clear();
    for (std::size_t k = 0; k < sheets_.size(); ++k)
        for (Index f = 0; f < sheets_[k].n_faces(); ++f) {
            const std::size_t count = magnetizations_.size() + sheets_[k].per_face();
            magnetizations_.resize(count, values.vector(magnetization_[k], f));
            thicknesses_.resize(count, values.number(thickness_[k], f));
        }
    of_tetrahedra_.clear();
    for (std::size_t k = 0; k < solids_.size(); ++k)
        for (Index t = 0; t < solids_[k].solid->n_elements(); ++t)
            of_tetrahedra_.push_back(values.vector(of_solids_[k], t));
    field_.set(magnetizations_, thicknesses_, of_tetrahedra_);
    std::vector<OwnField::DipoleWeights> dipoles;
    for (std::size_t k = 0; k < magnets_.size(); ++k)
        dipoles.push_back({.position = corners_[k].of_point(values.vector(center_[k], 0)),
                           .moment = corners_[k].of_vector(values.vector(moment_[k], 0))});
    field_.set(dipoles);
    if (field_.n_points() > max_points_)
        throw InvalidInput("the own field has " + std::to_string(field_.n_points()) +
                           " source points, more than max_points = " + std::to_string(max_points_) +
                           " of the OwnField. Use a "
                           "coarser mesh, fewer bodies, a uniform tangential magnetization (whose sources "
                           "lie on the border only), or "
                           "ms.OwnField(max_points=...)");
    sources_ = std::make_shared<const OwnField>(field_.of_sources());
    return true;
}

double OwnFieldTerm::energy(const double* q, const LoadParameters& load_parameters) const {
    const double factor = load_parameters[factor_.first];
    if (!sources_->acts() || factor == 0.0) return 0.0;
    return factor * state_at(q)->energy;
}

void OwnFieldTerm::evaluate(const double* q, const LoadParameters& load_parameters, Residual& out) {
    const double factor = load_parameters[factor_.first];
    if (!sources_->acts() || factor == 0.0) return;
    const std::shared_ptr<const State> state = state_at(q);
    for (std::size_t k = 0; k < state->by_position.size(); ++k)
        for (int i = 0; i < 3; ++i) out.add(3 * sources_->nodes()[k] + i, factor * state->by_position[k][i]);
}

std::shared_ptr<const HessianOperator> OwnFieldTerm::hessian_operator(
    const double* q, const LoadParameters& load_parameters) const {
    const double factor = load_parameters[factor_.first];
    if (!sources_->acts() || factor == 0.0) return nullptr;
    return std::make_shared<const Hessian>(sources_, *state_at(q), factor, product_);
}

std::shared_ptr<const OwnFieldTerm::State> OwnFieldTerm::state_at(const double* q) const {
    const std::shared_ptr<const State> last = state_;
    if (last && last->sources == sources_ && std::equal(q, q + n_dofs_, last->q.data())) return last;
    const std::shared_ptr<State> state = std::make_shared<State>();
    state->sources = sources_;
    state->q = Eigen::Map<const VectorXd>(q, n_dofs_);
    state->near = sources_->neighbours(q);
    state->energy = sources_->gradient(q, state->near, state->by_position);
    state_ = state;
    return state;
}

std::vector<double> OwnFieldTerm::own_energies(const double* q) const {
    std::vector<double> energies;
    const auto add = [&](OwnField alone, const std::vector<Vec3>& magnetizations,
                         const std::vector<double>& thicknesses, const std::vector<Vec3>& of_tetrahedra) {
        alone.set_accuracy(field_.accuracy());
        alone.set(magnetizations, thicknesses, of_tetrahedra);
        std::vector<Vec3> by_position;
        energies.push_back(alone.gradient(q, alone.neighbours(q), by_position));
    };
    std::ptrdiff_t first = 0;
    for (const SheetTriangles& sheet : sheets_) {
        const std::ptrdiff_t last = first + sheet.n_triangles();
        add(OwnField(triangles_of(std::vector{sheet}), {}, {}),
            {magnetizations_.begin() + first, magnetizations_.begin() + last},
            {thicknesses_.begin() + first, thicknesses_.begin() + last}, {});
        first = last;
    }
    first = 0;
    for (const MagnetizedSolid& each : solids_) {
        const std::ptrdiff_t last = first + each.solid->n_elements();
        add(OwnField({}, triangles_of(std::vector{each}), {}), {}, {},
            {of_tetrahedra_.begin() + first, of_tetrahedra_.begin() + last});
        first = last;
    }
    return energies;
}

OwnField::GapForces OwnFieldTerm::gap_forces(const double* q) const {
    std::vector<Index> of_faces, of_tetrahedra;
    Index body = 0;
    for (const SheetTriangles& sheet : sheets_) of_faces.insert(of_faces.end(), sheet.n_triangles(), body++);
    for (const MagnetizedSolid& each : solids_)
        of_tetrahedra.insert(of_tetrahedra.end(), each.solid->n_elements(), body++);
    VectorXd rest = VectorXd::Zero(n_dofs_);
    const auto set = [&](const std::vector<std::array<Index, 3>>& nodes,
                         const std::vector<std::array<Vec3, 3>>& corners) {
        for (std::size_t k = 0; k < nodes.size(); ++k)
            for (int i = 0; i < 3; ++i) rest.segment<3>(3 * nodes[k][i]) = corners[k][i];
    };
    const OwnField::Faces faces = triangles_of(sheets_);
    const OwnField::Triangles triangles = triangles_of(solids_);
    set(faces.nodes, faces.rest);
    set(triangles.nodes, triangles.rest);
    return field_.gap_forces(q, rest.data(), state_at(q)->near, of_faces, of_tetrahedra, body);
}

std::vector<std::string> OwnFieldTerm::owners() const {
    std::vector<std::string> owners;
    for (const SheetTriangles& sheet : sheets_) owners.push_back(sheet.owner());
    for (const MagnetizedSolid& each : solids_) owners.push_back(each.solid->owner);
    return owners;
}

void OwnFieldTerm::vjp(const double* q, const LoadParameters& load_parameters, const double* lambda,
                       Gradient& out) {
    const double factor = load_parameters[factor_.first];
    OwnField::FaceGradient by = field_.vjp(q, lambda);
    by_rest_ = std::move(by.rest);
    Product product{.q = Eigen::Map<const VectorXd>(q, n_dofs_),
                    .direction = Eigen::Map<const VectorXd>(lambda, n_dofs_),
                    .image = VectorXd::Zero(n_dofs_)};
    for (std::size_t k = 0; k < by.by_position.size(); ++k)
        product.image.segment<3>(3 * field_.nodes()[k]) = by.by_position[k];
    product_ = std::make_shared<const Product>(std::move(product));
    std::size_t triangle = 0;
    for (std::size_t k = 0; k < sheets_.size(); ++k)
        for (Index t = 0; t < sheets_[k].n_triangles(); ++t, ++triangle) {
            const Index face = t / sheets_[k].per_face();
            out.values.segment<3>(magnetization_[k].at(face)) += factor * by.magnetization[triangle];
            out.values[thickness_[k].at(face)] += factor * by.thickness[triangle];
        }
    std::size_t tetrahedron = 0;
    for (std::size_t k = 0; k < solids_.size(); ++k)
        for (Index t = 0; t < solids_[k].solid->n_elements(); ++t)
            out.values.segment<3>(of_solids_[k].at(t)) += factor * by.of_tetrahedra[tetrahedron++];
    for (std::size_t k = 0; k < magnets_.size(); ++k) {
        out.values.segment<3>(moment_[k].first) += factor * corners_[k].gradient(by.of_dipoles[k].moment);
        out.values.segment<3>(center_[k].first) += factor * corners_[k].gradient(by.of_dipoles[k].position);
    }
    if (!sources_->acts()) return;
    const std::shared_ptr<const State> state = state_at(q);
    for (std::size_t k = 0; k < state->by_position.size(); ++k)
        out.load_parameters[factor_.first] +=
            state->by_position[k].dot(Eigen::Map<const Vec3>(lambda + 3 * sources_->nodes()[k]));
}

void OwnFieldTerm::add_rest_vjp(const double*, const LoadParameters& load_parameters, const double*,
                                VectorXd& out) {
    const double factor = load_parameters[factor_.first];
    const OwnField::Faces faces = triangles_of(sheets_);
    for (std::size_t f = 0; f < faces.nodes.size(); ++f)
        for (int i = 0; i < 3; ++i) out.segment<3>(3 * faces.nodes[f][i]) += factor * by_rest_.corners[f][i];
    add_triangles_rest_vjp(factor, out);
}

// Q = a . (M_1 - M_2) with the area vector a at rest, of magnetizations that stretch.
void OwnFieldTerm::add_triangles_rest_vjp(double factor, VectorXd& out) const {
    const OwnField::Triangles triangles = triangles_of(solids_);
    const auto stretching = [&](Index t) -> Vec3 {
        return t < 0 || triangles.rotates[t] ? Vec3::Zero() : of_tetrahedra_[t];
    };
    for (std::size_t t = 0; t < triangles.nodes.size(); ++t) {
        const std::array<Vec3, 3>& x = triangles.rest[t];
        const auto& [first, second] = triangles.tetrahedra[t];
        const OwnField::TriangleGradient& by = by_rest_.triangles[t];
        const Vec3 by_area = by.charge * (stretching(first) - stretching(second)) + by.area;
        std::array<double, 3> lengths;
        for (int i = 0; i < 3; ++i) lengths[i] = (x[(i + 1) % 3] - x[i]).norm();
        const std::array<double, 3> longest = parts_of_longest(lengths);
        for (int i = 0; i < 3; ++i) {
            const Vec3 &next = x[(i + 1) % 3], last = x[(i + 2) % 3];
            const Vec3 pull = by.length * longest[i] * (next - x[i]).normalized();
            out.segment<3>(3 * triangles.nodes[t][i]) +=
                factor * (0.5 * by_area.cross(last - next) + by.volume / 6.0 * next.cross(last) - pull);
            out.segment<3>(3 * triangles.nodes[t][(i + 1) % 3]) += factor * pull;
        }
    }
}

}  // namespace magshell
