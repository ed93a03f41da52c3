#include "magshell/solve/load_predictor.h"

namespace magshell {

void LoadPredictor::went(const VectorXd& from, const VectorXd& tangent, double step) {
    if (tangent.size() == 0) return forget();
    before_ = from;
    rate_ = tangent / step;
    step_ = step;
}

// From here at s = 0: here + rate s + b s^2 + c s^3, whose value and slope at s = - h are those of before.
VectorXd LoadPredictor::bend(const VectorXd& here, const VectorXd& tangent, double step) const {
    constexpr double small = 0.5;  // of the tangent: a series whose terms hardly fall off tells nothing
    if (before_.size() == 0) return {};
    const double h = step_;
    const VectorXd rate = tangent / step, value = (before_ - here + h * rate) / (h * h),
                   slope = (rate_ - rate) / h, c_h = slope + 2.0 * value;
    VectorXd more = step * step * (value + (1.0 + step / h) * c_h);
    const auto length = [&](const VectorXd& p) { return p.head(coordinates_).lpNorm<Eigen::Infinity>(); };
    if (!(length(more) <= small * length(tangent))) more.resize(0);
    return more;
}

}  // namespace magshell
