#include "magshell/solve/landing.h"

#include <algorithm>
#include <cmath>
#include <tuple>

namespace magshell {
namespace {

constexpr double too_hard = 2.0;  // times what will be

/// At which w depth + k S'(depth) is `pull`, for a law of S' = d^2/(2 e) up to e and d - e/2 from there on.
double depth_at(double pull, double w, const ContactLaw& law) {
    const double k = law.stiffness, e = law.smoothing;
    if (pull >= (w + 0.5 * k) * e) return (pull + 0.5 * k * e) / (w + k);
    return 2.0 * pull / (w + std::sqrt(w * w + 2.0 * k / e * pull));
}

}  // namespace

VectorXd landing(const Model& model, const VectorXd& q, const Controls& controls, const VectorXd& weights,
                 const std::vector<ContactTerm::ActiveContact>& expected) {
    const ContactTerm& contact = *model.contact();
    const auto before = [](const ContactTerm::ActiveContact* one, const ContactTerm::ActiveContact* other) {
        const auto key = [](const ContactTerm::ActiveContact& touch) {
            return std::tie(touch.contact, touch.obstacle, touch.point);
        };
        return key(*one) < key(*other);
    };
    std::vector<const ContactTerm::ActiveContact*> sorted;
    for (const ContactTerm::ActiveContact& touch : expected) sorted.push_back(&touch);
    if (!std::is_sorted(sorted.begin(), sorted.end(), before))
        std::sort(sorted.begin(), sorted.end(), before);
    VectorXd move;
    for (const ContactTerm::ActiveContact& touch : contact.active_contacts(q.data(), controls)) {
        const auto same = std::lower_bound(sorted.begin(), sorted.end(), &touch, before);
        const double force = same != sorted.end() && !before(&touch, *same) ? (*same)->force : 0.0;
        const ContactPoint& point = contact.point(touch);
        if (point.nodes[1] >= 0) continue;  // what is on a face is not alone
        const ContactLaw& law = contact.law(touch);
        const double w = weights[3 * point.nodes[0]], depth = law.offset - touch.at.value;
        if (!(w > 0.0)) continue;
        const double out = depth - depth_at(w * depth + force, w, law);
        if (touch.force <= too_hard * (w * out + force)) continue;
        if (move.size() == 0) move = VectorXd::Zero(q.size());
        move.segment<3>(3 * point.nodes[0]) += out * touch.at.normal;
    }
    if (move.size() == 0) return move;
    move = model.reduction().project(move);
    // Nothing is to be crossed on the way, nor elements turned inside out.
    if (const double share = model.share_of_step(q, move); share < 1.0) move *= share;
    return move;
}

std::vector<ContactTerm::ActiveContact> after_step(const Model& model, const VectorXd& p) {
    const ContactTerm& contact = *model.contact();
    std::vector<ContactTerm::ActiveContact> all = contact.evaluated_contacts();
    for (ContactTerm::ActiveContact& touch : all)
        touch.force = std::max(
            0.0, touch.force - touch.stiffness * touch.at.normal.dot(contact.at_point(touch, p.data())));
    return all;
}

}  // namespace magshell
