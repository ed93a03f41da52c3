#include "magshell/solve/motion/contact_predictor.h"

#include <algorithm>
#include <cmath>
#include <tuple>

namespace magshell {
namespace {

// [-] Ratio of the penalty force to the balanced force above which a vertex is moved; see test_an_impact_takes_few_factorizations.
constexpr double overshoot_ratio = 2.0;

/// Returns the depth [m] at which w depth + k S'(depth) equals `pull` [N], for a penalty law with S' = d^2/(2 e) up to d = e and
/// d - e/2 beyond.
double equilibrium_depth(double pull, double w, const ContactLaw& law) {
    const double k = law.stiffness, e = law.smoothing;
    if (pull >= (w + 0.5 * k) * e) return (pull + 0.5 * k * e) / (w + k);
    return 2.0 * pull / (w + std::sqrt(w * w + 2.0 * k / e * pull));
}

}  // namespace

VectorXd predict_contact(const Model& model, const VectorXd& q, const LoadParameters& load_parameters,
                         const VectorXd& weights, const std::vector<Contacts::ObstaclePoint>& expected) {
    const Contacts& contact = model.contacts();
    const auto before = [](const Contacts::ObstaclePoint* one, const Contacts::ObstaclePoint* other) {
        const auto key = [](const Contacts::ObstaclePoint& touch) {
            return std::tie(touch.contact, touch.obstacle, touch.point);
        };
        return key(*one) < key(*other);
    };
    std::vector<const Contacts::ObstaclePoint*> sorted;
    for (const Contacts::ObstaclePoint& touch : expected) sorted.push_back(&touch);
    if (!std::is_sorted(sorted.begin(), sorted.end(), before))
        std::sort(sorted.begin(), sorted.end(), before);
    VectorXd move;
    for (const Contacts::ObstaclePoint& touch : contact.obstacle_points(q, load_parameters)) {
        const auto same = std::lower_bound(sorted.begin(), sorted.end(), &touch, before);
        const double force = same != sorted.end() && !before(&touch, *same) ? (*same)->force : 0.0;
        if (touch.round) continue;  // of rigid bodies, whose vertices are not free
        const ContactPoint& point = contact.point(touch);
        if (point.nodes[1] >= 0) continue;  // the balance of one vertex does not hold for a point on a face
        const ContactLaw& law = contact.law(touch);
        const double w = weights[3 * point.nodes[0]], depth = law.offset - touch.at.value;
        if (!(w > 0.0)) continue;
        const double out = depth - equilibrium_depth(w * depth + force, w, law);
        if (touch.force <= overshoot_ratio * (w * out + force)) continue;
        if (move.size() == 0) move = VectorXd::Zero(q.size());
        move.segment<3>(3 * point.nodes[0]) += out * touch.at.normal;
    }
    if (move.size() == 0) return move;
    move = model.dof_map().project(move);
    // The displacement must not cross another body, nor invert an element.
    if (const double share = model.capabilities().admissible_step_length(q, move); share < 1.0) move *= share;
    return move;
}

}  // namespace magshell
