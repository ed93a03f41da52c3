#include "magshell/scene/rest_gradient.h"

#include "magshell/energy/surface_tension.h"
#include "magshell/terms/actuator/muscle_rate_term.h"
#include "magshell/terms/contact/body_friction_term.h"
#include "magshell/terms/contact/contact_term.h"
#include "magshell/terms/contact/friction_term.h"
#include "magshell/terms/joint/damper_term.h"
#include "magshell/terms/joint/joint_term.h"
#include "magshell/terms/joint/torque_term.h"
#include "magshell/terms/load/body_force_term.h"
#include "magshell/terms/load/face_energy.h"
#include "magshell/terms/load/group_energy_term.h"
#include "magshell/terms/load/load_term.h"
#include "magshell/terms/load/pressure_term.h"
#include "magshell/terms/load/spring_term.h"
#include "magshell/terms/load/water_term.h"
#include "magshell/terms/magnetic/moment_term.h"
#include "magshell/terms/rest_shape_term.h"

namespace magshell {
namespace {

// Returns true for terms of one of the kinds.
template <class... Kinds>
bool is_one_of(const auto& term) {
    return ((dynamic_cast<const Kinds*>(&term) != nullptr) || ...);
}

// Returns true if add_rest_vjp() is complete for a term: it has the derivatives, or reads no rest shape, as terms whose
// forces follow from present positions and from values that the caller computes.
bool rest_gradient_is_complete(const Term& term) {
    return is_one_of<RestShapeTerm, LoadTerm, PressureTerm, ContactTerm, FaceEnergyTerm<SurfaceTension>,
                     GroupEnergyTerm, SpringTerm, MomentTerm, BodyForceTerm, TorqueTerm, JointTerm,
                     DamperTerm>(term);
}

}  // namespace

void add_rest_vjp(Model& model, const VectorXd& q, const LoadParameters& load_parameters,
                  const VectorXd& lambda, VectorXd& out) {
    for (const std::unique_ptr<Term>& term : model.terms().energies)
        if (auto* const shaped = dynamic_cast<RestShapeTerm*>(term.get()))
            shaped->add_rest_vjp(q.data(), load_parameters, lambda.data(), out);
}

void add_rest_forces_vjp(const Model& model, const VectorXd& lambda, VectorXd& out) {
    for (const std::unique_ptr<ForceTerm>& force : model.terms().forces)
        force->add_rest_vjp(model.kinematics(), lambda, out);
}

void add_rest_strains_vjp(const ViscousTerms& terms, const StrainSet& stresses, VectorXd& out) {
    for (std::size_t k = 0; k < terms.all().size(); ++k)
        if (const auto* const shaped = dynamic_cast<const RestShapeTerm*>(terms.all()[k]))
            shaped->add_rest_strains_vjp(stresses.of_terms[k], out);
}

std::vector<std::string_view> without_rest_gradient(const Model& model) {
    std::vector<std::string_view> names;
    for (const std::unique_ptr<Term>& term : model.terms().energies)
        if (!rest_gradient_is_complete(*term)) names.push_back(term->name());
    for (const std::unique_ptr<ForceTerm>& force : model.terms().forces)
        if (!is_one_of<BodyFrictionTerm, FrictionTerm, WaterTerm, MuscleRateTerm<LinearTetrahedron>,
                       MuscleRateTerm<QuadraticTetrahedron>>(*force))
            names.push_back(force->name());
    return names;
}

}  // namespace magshell
