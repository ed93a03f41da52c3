#include "magshell/scene/shell_stresses.h"

#include <Eigen/LU>

#include "magshell/energy/material.h"
#include "magshell/scene/creased_edges.h"
#include "magshell/scene/shell_loops.h"
#include "magshell/terms/shell/bending_term.h"
#include "magshell/terms/shell/membrane_term.h"

namespace magshell {
namespace {

/// A face at rest: converts between three numbers per face, one per edge, and tensors in its plane.
class Measures {
  public:
    explicit Measures(const std::array<Vec3, 3>& x) : Measures(x, RestFace(x.data())) {}
    /// face: the same face with growth.
    Measures(const std::array<Vec3, 3>& x, const RestFace& face) : face_(face) {
        const Vec3 edge = x[2] - x[1], across = edge.cross(x[0] - x[2]);
        axes_.col(0) = edge.normalized();
        axes_.col(1) = across.normalized().cross(axes_.col(0));
    }

    /// Returns the sum of numbers[i] times the measure of edge i.
    Mat3 tensor(const std::array<Eigen::Matrix2d, 3>& measures, const Vec3& numbers) const {
        const Eigen::Matrix2d sum =
            numbers[0] * measures[0] + numbers[1] * measures[1] + numbers[2] * measures[2];
        return axes_ * sum * axes_.transpose();
    }

    /// Returns T with A~ T : measures[i] = work[i].
    Mat3 conjugate(const std::array<Eigen::Matrix2d, 3>& measures, const Vec3& work) const {
        Mat3 rows;
        for (int i = 0; i < 3; ++i)
            rows.row(i) << measures[i](0, 0), 2.0 * measures[i](0, 1), measures[i](1, 1);
        // The rows of one face are of similar size; dividing by it keeps the pivots in range for small faces.
        const double size = rows.cwiseAbs().maxCoeff();
        const Vec3 found = (rows / size).fullPivLu().solve(work / (size * face_.area));
        Eigen::Matrix2d tensor;
        tensor << found[0], found[1], found[1], found[2];
        return axes_ * tensor * axes_.transpose();
    }

    const RestFace& face() const { return face_; }

  private:
    RestFace face_;
    Eigen::Matrix<double, 3, 2> axes_;
};

Vec3 squared_lengths(const Vec3 x[3]) {
    return {(x[2] - x[1]).squaredNorm(), (x[0] - x[2]).squaredNorm(), (x[1] - x[0]).squaredNorm()};
}

}  // namespace

std::vector<FaceStress> shell_stresses(const Model& model, Index number, const VectorXd& q) {
    const Index flat = static_cast<Index>(model.bodies().shells().size());
    if (number >= flat) return six_node_stresses(model, number - flat, q);
    const Shell& shell = *model.bodies().shells()[number];
    const MembraneFaces& membrane = *model.terms().membrane_faces[number];
    const std::vector<double> changes = shell_loops::angle_changes(shell, q.data());
    const auto change_of = [&](Index dihedral) { return changes[dihedral]; };
    const double* rotations = q.data() + model.nodes().first_scalar();
    const MembraneTerm& stretching =
        dynamic_cast<const MembraneTerm&>(model.terms().elastic_term(number, "membrane"));
    const BendingTerm& bending =
        dynamic_cast<const BendingTerm&>(model.terms().elastic_term(number, "bending"));

    const CreasedEdges creases(model, shell, bending, q);
    Strains stretches(shell.n_faces()), bends(shell.n_faces());
    for (Index f = 0; f < shell.n_faces(); ++f) {
        const std::array<Vec3, 3> rest = membrane.rest_corners(f);
        Vec3 x[3];
        for (int k = 0; k < 3; ++k) x[k] = q.segment<3>(3 * membrane.corners()[f][k]);
        const Vec3 turned = bending.natural_angle_changes(f);
        const Vec3 change = squared_lengths(x) - (stretching.grows() ? stretching.grown(f).squared_lengths()
                                                                     : squared_lengths(rest.data()));
        for (int i = 0; i < 3; ++i) {
            stretches.set(f, i, change[i]);
            bends.set(f, i, bending_strain(shell.sides[f][i], change_of, rotations) - turned[i]);
        }
    }
    const Strains pulls = stretching.stresses(stretches);
    const Strains moments = bending.stresses(bends);

    std::vector<FaceStress> out(shell.n_faces());
    const auto three = [](const Strains& of, Index f) {
        return Vec3(of.number(f, 0), of.number(f, 1), of.number(f, 2));
    };
    shell_loops::over_blocks(shell.n_faces(), [&](Index from, Index to) {
        for (Index f = from; f < to; ++f) {
            const auto measures = [f](const auto& term, const std::array<Vec3, 3>& rest) {
                return term.grows() ? Measures(rest, term.grown(f).face()) : Measures(rest);
            };
            const Measures cut = measures(stretching, membrane.rest_corners(f)),
                           own = measures(bending, shell.rest_corners(f));
            const auto of_stretch = cut.face().membrane_measures(), of_bend = own.face().bending_measures();
            const Vec3 bent = three(bends, f), moment = creases.moments(f, bent, three(moments, f));
            out[shell.faces.user[f]] = {cut.tensor(of_stretch, three(stretches, f)),
                                        own.tensor(of_bend, creases.strains_of_sheet(f, bent)),
                                        cut.conjugate(of_stretch, three(pulls, f)),
                                        own.conjugate(of_bend, moment)};
        }
    });
    return out;
}

}  // namespace magshell
