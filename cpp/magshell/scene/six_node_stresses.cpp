#include <Eigen/LU>
#include <cmath>

#include "magshell/scene/shell_stresses.h"
#include "magshell/strain/six_nodes.h"
#include "magshell/terms/shell6/bending_six_term.h"
#include "magshell/terms/shell6/membrane_six_term.h"

namespace magshell {
namespace {

constexpr double far = 2.0 / 3.0, near = 1.0 / 6.0, even = 1.0 / 3.0;
constexpr std::array<std::array<double, 3>, 4> middles = {
    {{far, near, near}, {near, far, near}, {near, near, far}, {even, even, even}}};

using Numbers = Eigen::Vector<double, 9>;

Numbers numbers_of(const Strains& of, Index f) {
    Numbers found;
    for (int r = 0; r < 9; ++r) found[r] = of.number(f, r);
    return found;
}

/// The tangent plane of a face at rest, at one of its points.
class Tangents {
  public:
    Tangents(const std::array<Vec3, 6>& rest, const std::array<double, 3>& at) {
        for (int i = 0; i < 3; ++i) {
            along_[i].setZero();
            const std::array<double, 6> by_node = six_nodes::derivative(i, at);
            for (int a = 0; a < 6; ++a) along_[i] += by_node[a] * rest[a];
        }
        find_normal();
    }
    explicit Tangents(const std::array<Vec3, 3>& along) : along_(along) { find_normal(); }

    Mat3 plane() const { return Mat3::Identity() - normal_ * normal_.transpose(); }

    /// Returns T_i = - sym(t_j (x) t_k) / J^2.
    Mat3 direction(int i) const {
        const Mat3 product = along_[(i + 1) % 3] * along_[(i + 2) % 3].transpose();
        return -0.5 / (jacobian_ * jacobian_) * (product + product.transpose());
    }

    /// Returns E with t_i . E t_i = stretches[i] / 2, using T_l^ = - sym(n_j (x) n_k) with n_i . t_i = 0, for which t_i . T_l^ t_i is zero unless
    /// i = l.
    Mat3 green(const Vec3& stretches) const {
        Mat3 sum = Mat3::Zero();
        for (int i = 0; i < 3; ++i) {
            const Vec3 j = along_[(i + 1) % 3].cross(normal_), k = along_[(i + 2) % 3].cross(normal_);
            const Mat3 product = j * k.transpose();
            sum -= 0.25 * stretches[i] / (jacobian_ * jacobian_) * (product + product.transpose());
        }
        return sum;
    }

  private:
    void find_normal() {
        const Vec3 across = along_[0].cross(along_[1]);
        jacobian_ = across.norm();
        normal_ = across / jacobian_;
    }

    std::array<Vec3, 3> along_;
    Vec3 normal_;
    double jacobian_;
};

Mat3 moment_at(const SixNodeFace& face, const Tangents& tangents, const std::array<double, 3>& at,
               const Numbers& moments) {
    const std::array<double, 9> tests = face.tests(at);
    Mat3 sum = Mat3::Zero();
    for (int i = 0; i < 3; ++i)
        sum += (tests[3 * i] * moments[3 * i] + tests[3 * i + 1] * moments[3 * i + 1] +
                tests[3 * i + 2] * moments[3 * i + 2]) *
               tangents.direction(i);
    return sum;
}

struct Terms {
    const SixNodeShell& shell;
    const MembraneSixTerm& membrane;
    const BendingSixTerm& bending;

    Terms(const Model& model, Index number)
        : shell(*model.bodies().six_node_shells()[number]),
          membrane(dynamic_cast<const MembraneSixTerm&>(
              model.terms().elastic_term(model.bodies().six_node_bodies()[number], "membrane"))),
          bending(dynamic_cast<const BendingSixTerm&>(
              model.terms().elastic_term(model.bodies().six_node_bodies()[number], "bending"))) {}

    /// Calls take(row, face, tangents, point, Green's strain) for all rows.
    template <class Take>
    void each(const Strains& stretches, const Take& take) const {
        for (Index f = 0; f < shell.n_faces(); ++f) {
            const Numbers stretched = numbers_of(stretches, f);
            for (std::size_t k = 0; k < middles.size(); ++k) {
                const Tangents tangents = bending.grows()
                                              ? Tangents(bending.grown(f).grown_tangents(middles[k]))
                                              : Tangents(shell.rest[f], middles[k]);
                take(4 * shell.faces.user[f] + static_cast<Index>(k), f, tangents, middles[k],
                     tangents.green(membrane_interpolation(middles[k]) * stretched));
            }
        }
    }
};

}  // namespace

std::vector<SixNodeStrain> six_node_strains(const Model& model, Index number, const VectorXd& q) {
    const Terms terms(model, number);
    const Strains bends = terms.bending.strains_at(q.data());
    // On a flat face the curvature that belongs to the moments is the same for all materials.
    const ShellMaterial unit{.thickness = 1.0, .young_modulus = 12.0, .poisson_ratio = 0.0};
    std::vector<SixNodeStrain> out(4 * static_cast<std::size_t>(terms.shell.n_faces()));
    Index last = -1;
    Numbers moments;
    terms.each(terms.membrane.strains_at(q.data()), [&](Index row, Index f, const Tangents& tangents,
                                                        const std::array<double, 3>& at, const Mat3& green) {
        if (f != last) moments = terms.bending.rest(f).bending_stiffness(unit) * numbers_of(bends, f);
        last = f;
        out[row] = {green, moment_at(terms.bending.rest(f), tangents, at, moments)};
    });
    return out;
}

std::vector<FaceStress> six_node_stresses(const Model& model, Index number, const VectorXd& q) {
    const Terms terms(model, number);
    const Strains moments = terms.bending.stresses(terms.bending.strains_at(q.data()));
    std::vector<FaceStress> out(4 * static_cast<std::size_t>(terms.shell.n_faces()));
    terms.each(terms.membrane.strains_at(q.data()), [&](Index row, Index f, const Tangents& tangents,
                                                        const std::array<double, 3>& at, const Mat3& green) {
        const auto& [thickness, modulus, nu] = terms.membrane.material(f);
        const Mat3 plane = tangents.plane(),
                   moment = moment_at(terms.bending.rest(f), tangents, at, numbers_of(moments, f));
        const double stretching = modulus * thickness / (1.0 - nu * nu),
                     bending = modulus * thickness * thickness * thickness / 12.0;
        out[row] = {green, ((1.0 + nu) * moment - nu * moment.trace() * plane) / bending,
                    stretching * ((1.0 - nu) * green + nu * green.trace() * plane), moment};
    });
    return out;
}

Eigen::Vector2d principal_in_plane(const Mat3& tensor) {
    const double middle = 0.5 * tensor.trace();
    const double radius = std::sqrt(std::max(0.5 * tensor.squaredNorm() - middle * middle, 0.0));
    return {middle + radius, middle - radius};
}

}  // namespace magshell
