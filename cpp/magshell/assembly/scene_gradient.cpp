#include "magshell/assembly/scene_gradient.h"

namespace magshell {
namespace {

template <class Numbers>
void add(Numbers& sum, const Numbers& part) {
    if (sum.size() == 0)
        sum = part;
    else if (part.size() > 0)
        sum += part;
}

template <class Each, class Add>
void add_each(std::vector<Each>& sum, const std::vector<Each>& part, const Add& add_one) {
    if (sum.size() < part.size()) sum.resize(part.size());
    for (std::size_t k = 0; k < part.size(); ++k) add_one(sum[k], part[k]);
}

}  // namespace

void SceneGradient::add_scene(const SceneGradient& part) {
    for (VectorXd SceneGradient::* each :
         {&SceneGradient::thickness, &SceneGradient::young_modulus, &SceneGradient::poisson_ratio,
          &SceneGradient::curvature_scale, &SceneGradient::weights, &SceneGradient::loads,
          &SceneGradient::couples})
        add(this->*each, part.*each);
    add(remanent_magnetization, part.remanent_magnetization);
    add_each(motions, part.motions, [](Motion& sum, const Motion& one) {
        sum.centre += one.centre;
        sum.rotation_vector += one.rotation_vector;
        sum.translation += one.translation;
    });
    add_each(field_sources, part.field_sources, [](VectorXd& sum, const VectorXd& one) { add(sum, one); });
    add_each(contacts, part.contacts, [](ContactLaw& sum, const ContactLaw& one) { sum.add(one); });
    water.add(part.water, 1.0);
    add_each(obstacles, part.obstacles, [](Placement& sum, const Placement& one) {
        sum.center += one.center;
        sum.rotation_vector += one.rotation_vector;
    });
}

}  // namespace magshell
