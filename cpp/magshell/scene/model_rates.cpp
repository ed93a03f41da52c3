// Of a model, how fast what it evaluates changes with the controls.
#include "magshell/scene/model.h"

namespace magshell {
namespace {

constexpr double difference = 1e-3;  // of the way that a path of equilibria goes from its start on

}  // namespace

// What varies may enter in any way: the place of a magnet does. Differences of fourth order lose no more digits
// than a gradient has lost already, and paths only aim by them.
template <class Function>
VectorXd Model::rate_by_varying(const Controls& at, const Controls& rate, const Function& function) {
    const Index n = varying_.size();
    VectorXd sum = VectorXd::Zero(size());
    if (rate.tail(n).isZero(0.0)) return sum;
    const auto beside = [&](double way) {
        Controls there = at;
        there.tail(n) += way * rate.tail(n);
        take(there);
        return function(there);
    };
    for (const double steps : {1.0, 2.0}) {
        const double weight = (steps == 1.0 ? 8.0 : -1.0) / (12.0 * difference);
        sum += weight * (beside(steps * difference) - beside(-steps * difference));
    }
    take(at);
    return sum;
}

VectorXd Model::gradient_rate(const VectorXd& q, const Controls& at, const Controls& rate) {
    // Of what is linear in the controls, but for a constant: that of volumes that are wanted.
    const Controls none = Controls::Zero(rate.size());
    Residual change, constant, dropped;
    for (Residual* each : {&change, &constant, &dropped}) each->reset(size());
    for (const std::unique_ptr<Term>& term : terms_) {
        if (!term->depends_on_loads()) continue;
        term->evaluate(q.data(), rate, change);
        term->evaluate(q.data(), none, constant);
        term->evaluate(q.data(), at, dropped);  // where it is again
    }
    change.gradient -= constant.gradient;
    if (varying_.empty()) return change.gradient;
    return change.gradient + rate_by_varying(at, rate, [&](const Controls& there) {
               Residual gradient;
               gradient.reset(size());
               for (const std::unique_ptr<Term>& term : terms_)
                   if (term->varies()) term->evaluate(q.data(), there, gradient);
               return gradient.gradient;
           });
}

VectorXd Model::prescribed_rate(const VectorXd& q, const Controls& at, const Controls& rate) {
    const VectorXd held = reduction_.progress(rate) * reduction_.prescribed_rate(at);
    if (varying_.empty()) return held;
    return held + rate_by_varying(at, rate, [&](const Controls& there) {
               return reduction_.prescribed_increment(q, there);
           });
}

}  // namespace magshell
