#include "magshell/terms/magnetic/own_field_term.h"

#include <string>

#include "magshell/core/errors.h"

namespace magshell {
namespace {

class OwnFieldHessian final : public HessianOperator {
  public:
    OwnFieldHessian(std::shared_ptr<const OwnField> field, const double* q, Index n_dofs, double factor)
        : field_(std::move(field)),
          q_(Eigen::Map<const VectorXd>(q, n_dofs)),
          near_(field_->neighbours(q)),
          factor_(factor) {}

    void add_product(const VectorXd& x, VectorXd& y) const override {
        VectorXd product = VectorXd::Zero(y.size());
        field_->add_hessian_product(q_.data(), near_, x.data(), product.data());
        y += factor_ * product;
    }

  private:
    std::shared_ptr<const OwnField> field_;
    VectorXd q_;
    OwnField::Neighbours near_;
    double factor_;
};

OwnField::Faces faces_of(const std::vector<OwnFieldTerm::Sheet>& sheets) {
    OwnField::Faces faces;
    for (const OwnFieldTerm::Sheet& sheet : sheets)
        for (Index f = 0; f < sheet.surface->n_faces(); ++f) {
            faces.nodes.push_back(sheet.surface->corners[f]);
            faces.rest.push_back(sheet.surface->rest_corners(f));
            faces.rotates.push_back(sheet.law == MagnetizationLaw::rotates);
        }
    return faces;
}

}  // namespace

OwnFieldTerm::OwnFieldTerm(std::vector<Sheet> sheets, Index max_points, double accuracy, Index n_dofs,
                           Registry& registry)
    : sheets_(std::move(sheets)),
      max_points_(max_points),
      n_dofs_(n_dofs),
      factor_(registry.load_parameters.add("scene", "own_field_factor", "1", 1, 1)),
      field_(faces_of(sheets_)),
      sources_(std::make_shared<const OwnField>(field_)) {
    field_.set_accuracy(accuracy);
    for (const Sheet& sheet : sheets_) {
        const Surface* const surface = sheet.surface;
        magnetization_.push_back(registry.values.add(surface->owner, "remanent_magnetization", "A/m",
                                                     surface->n_faces(), 3, &surface->faces));
        thickness_.push_back(
            registry.values.add(surface->owner, "thickness", "m", surface->n_faces(), 1, &surface->faces));
    }
}

bool OwnFieldTerm::set_values(const Values& values) {
    bool changed = false;
    for (std::size_t k = 0; k < sheets_.size(); ++k)
        changed |= values.changed(magnetization_[k], thickness_[k]);
    if (!changed) return false;
    magnetizations_.clear();
    thicknesses_.clear();
    for (std::size_t k = 0; k < sheets_.size(); ++k)
        for (Index f = 0; f < sheets_[k].surface->n_faces(); ++f) {
            magnetizations_.push_back(values.vector(magnetization_[k], f));
            thicknesses_.push_back(values.number(thickness_[k], f));
        }
    field_.set(magnetizations_, thicknesses_);
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
    std::vector<Vec3> by_position;
    return factor * sources_->gradient(q, sources_->neighbours(q), by_position);
}

void OwnFieldTerm::evaluate(const double* q, const LoadParameters& load_parameters, Residual& out) {
    const double factor = load_parameters[factor_.first];
    if (!sources_->acts() || factor == 0.0) return;
    std::vector<Vec3> by_position;
    sources_->gradient(q, sources_->neighbours(q), by_position);
    for (std::size_t k = 0; k < by_position.size(); ++k)
        for (int i = 0; i < 3; ++i) out.add(3 * sources_->nodes()[k] + i, factor * by_position[k][i]);
}

std::shared_ptr<const HessianOperator> OwnFieldTerm::hessian_operator(
    const double* q, const LoadParameters& load_parameters) const {
    const double factor = load_parameters[factor_.first];
    if (!sources_->acts() || factor == 0.0) return nullptr;
    return std::make_shared<const OwnFieldHessian>(sources_, q, n_dofs_, factor);
}

std::vector<double> OwnFieldTerm::own_energies(const double* q) const {
    std::vector<double> energies;
    std::ptrdiff_t first = 0;
    for (const Sheet& sheet : sheets_) {
        OwnField alone(faces_of({sheet}));
        alone.set_accuracy(field_.accuracy());
        const std::ptrdiff_t last = first + sheet.surface->n_faces();
        alone.set({magnetizations_.begin() + first, magnetizations_.begin() + last},
                  {thicknesses_.begin() + first, thicknesses_.begin() + last});
        std::vector<Vec3> by_position;
        energies.push_back(alone.gradient(q, alone.neighbours(q), by_position));
        first = last;
    }
    return energies;
}

void OwnFieldTerm::vjp(const double* q, const LoadParameters& load_parameters, const double* lambda,
                       Gradient& out) {
    const double factor = load_parameters[factor_.first];
    const OwnField::FaceGradient by = field_.vjp(q, lambda);
    std::size_t face = 0;
    for (std::size_t k = 0; k < sheets_.size(); ++k)
        for (Index f = 0; f < sheets_[k].surface->n_faces(); ++f, ++face) {
            out.values.segment<3>(magnetization_[k].at(f)) += factor * by.magnetization[face];
            out.values[thickness_[k].at(f)] += factor * by.thickness[face];
        }
    if (!sources_->acts()) return;
    std::vector<Vec3> by_position;
    sources_->gradient(q, sources_->neighbours(q), by_position);
    for (std::size_t k = 0; k < by_position.size(); ++k)
        out.load_parameters[factor_.first] +=
            by_position[k].dot(Eigen::Map<const Vec3>(lambda + 3 * sources_->nodes()[k]));
}

}  // namespace magshell
