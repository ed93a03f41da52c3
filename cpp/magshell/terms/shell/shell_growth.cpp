#include "magshell/terms/shell/shell_growth.h"

namespace magshell {

// Registers the tensors in the caller's order of faces, so that they may vary during a solve.
void ShellGrowth::Tensors::add(const std::string& owner, const char* name, const char* unit,
                               const TensorForm& form, Registry& registry) {
    if (form.rows == 0) return;
    slice = registry.values.add(owner, name, unit, form.rows, form.width);
    numbers.resize(slice.size());
}

bool ShellGrowth::Tensors::take(const Values& values) {
    if (slice.rows == 0 || !values.changed(slice)) return false;
    numbers.assign(values[slice], values[slice] + slice.size());
    return true;
}

Mat3 ShellGrowth::Tensors::at(Index row, double without) const {
    if (slice.rows == 0) return without * Mat3::Identity();
    const double* from = numbers.data() + static_cast<std::size_t>(row) * slice.width;
    if (slice.width == 1) return *from * Mat3::Identity();
    const Eigen::Map<const Mat3> given(from);
    return 0.5 * (given + given.transpose());
}

void ShellGrowth::Tensors::add_gradient(Index row, const Mat3& by, Gradient& out) const {
    if (slice.rows == 0) return;
    double* to = out.values.data() + slice.at(row);
    if (slice.width == 1)
        *to += by.trace();
    else
        Eigen::Map<Mat3>(to) += 0.5 * (by + by.transpose());
}

ShellGrowth::ShellGrowth(const std::string& owner, const Renumbering& faces, const GrowthForm& form,
                         Registry& registry)
    : faces_(faces) {
    growth_.add(owner, "growth", "1", form.growth, registry);
    curvature_.add(owner, "rest_curvature", "1/m", form.rest_curvature, registry);
}

bool ShellGrowth::set_values(const Values& values) {
    const bool grew = growth_.take(values), bent = curvature_.take(values);
    return grew || bent;
}

void ShellGrowth::add_vjp(Index face, const Mat3& by_growth, const Mat3& by_curvature, Gradient& out) const {
    growth_.add_gradient(row(growth_, face), by_growth, out);
    curvature_.add_gradient(row(curvature_, face), by_curvature, out);
}

}  // namespace magshell
