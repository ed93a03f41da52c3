#include "magshell/terms/joint/joint_form.h"

#include <cmath>
#include <complex>
#include <numbers>

namespace magshell {
namespace {

Vec3 across(const Vec3& axis) {
    Index smallest;
    axis.cwiseAbs().minCoeff(&smallest);
    return axis.cross(Vec3::Unit(smallest)).normalized();
}

}  // namespace

JointForm::JointForm(const Joint& joint, const LinkPair& links) : angle_(joint.kind == JointKind::revolute) {
    const auto add = [&](CornerForm& form, const Vec3& of_parent, const Vec3& of_child, double factor) {
        form.add(links.vector(false, of_parent), links.vector(true, of_child), factor);
    };
    if (angle_) {
        const Vec3 u = across(joint.axis), v = joint.axis.cross(u);
        add(form_, u, u, 1.0);
        add(form_, v, v, 1.0);
        add(sine_, v, u, 1.0);
        add(sine_, u, v, -1.0);
    } else if (joint.kind == JointKind::prismatic)
        form_.add(links.vector(false, joint.axis),
                  links.point(true, joint.origin) - links.point(false, joint.origin));
    else
        for (int c = 0; c < 3; ++c) add(form_, Vec3::Unit(c), Vec3::Unit(c), 1.0);
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
    return angle_ ? near + std::remainder(own - near, 2.0 * std::numbers::pi) : own;
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
