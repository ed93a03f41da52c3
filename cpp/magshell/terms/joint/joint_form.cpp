#include "magshell/terms/joint/joint_form.h"

#include <cmath>
#include <complex>
#include <numbers>

namespace magshell {

JointForm::JointForm(const JointCoordinate& coordinate, const Vec3& origin, const LinkPair& links)
    : angle_(!coordinate.sines.empty()) {
    const auto add = [&](CornerForm& form, const JointCoordinate::Product& product) {
        form.add(links.vector(false, product.of_parent), links.vector(true, product.of_child),
                 product.factor);
    };
    for (const JointCoordinate::Product& product : coordinate.products) add(form_, product);
    for (const JointCoordinate::Product& product : coordinate.sines) add(sine_, product);
    if (!coordinate.along.isZero(0.0))
        form_.add(links.vector(false, coordinate.along),
                  links.point(true, origin) - links.point(false, origin));
    slides_ = !coordinate.slide.isZero(0.0);
    if (slides_)
        slide_.add(links.vector(false, coordinate.slide),
                   links.point(true, origin) - links.point(false, origin));
}

JointForm JointForm::product(const LinkPair& links, const Vec3& of_parent, const Vec3& of_child) {
    JointForm form;
    form.form_.add(links.vector(false, of_parent), links.vector(true, of_child));
    return form;
}

JointForm JointForm::product(const LinkPair& links, const Mat3& of_parent, const Mat3& of_child) {
    JointForm form;
    for (int c = 0; c < 3; ++c)
        form.form_.add(links.vector(false, of_parent.col(c)), links.vector(true, of_child.col(c)));
    return form;
}

double JointForm::value(const Corners& at) const {
    return angle_ ? std::atan2(sine_.value(at), form_.value(at)) : form_.value(at);
}

double JointForm::value(const Corners& at, double near) const {
    const double own = value(at);
    const double turns = slides_ ? slide_.value(at) : near;
    return angle_ ? turns + std::remainder(own - turns, 2.0 * std::numbers::pi) : own;
}

JointForm::Local JointForm::at(const Corners& at) const {
    Local local;
    local.value = value(at);
    local.first = form_.gradient(at);
    local.pairs = form_.pairs;
    if (!angle_) return local;
    const std::complex<double> inverse = 1.0 / std::complex<double>(form_.value(at), sine_.value(at));
    const Corners by_sine = sine_.gradient(at), by_cosine = local.first;
    local.first = inverse.real() * by_sine + inverse.imag() * by_cosine;
    local.other = inverse.real() * by_cosine - inverse.imag() * by_sine;
    local.pairs = inverse.real() * sine_.pairs + inverse.imag() * form_.pairs;
    local.cross = -1.0;
    return local;
}

}  // namespace magshell
