#include "magshell/scene/sheet_stresses.h"

#include <Eigen/LU>

#include "magshell/energy/material.h"
#include "magshell/scene/sheet_loops.h"
#include "magshell/scene/six_node_stresses.h"
#include "magshell/term/bending_term.h"
#include "magshell/term/membrane_term.h"

namespace magshell {
namespace {

/// A face at rest: its tensors in the plane from three numbers, one an edge, and back.
class Measures {
  public:
    explicit Measures(const std::array<Vec3, 3>& x) : Measures(x, RestFace(x.data())) {}
    /// `face`: the same one, grown.
    Measures(const std::array<Vec3, 3>& x, const RestFace& face) : face_(face) {
        const Vec3 edge = x[2] - x[1], across = edge.cross(x[0] - x[2]);
        axes_.col(0) = edge.normalized();
        axes_.col(1) = across.normalized().cross(axes_.col(0));
    }

    /// The sum of numbers[i] times the measures of the edges.
    Mat3 tensor(const std::array<Eigen::Matrix2d, 3>& measures, const Vec3& numbers) const {
        const Eigen::Matrix2d sum =
            numbers[0] * measures[0] + numbers[1] * measures[1] + numbers[2] * measures[2];
        return axes_ * sum * axes_.transpose();
    }

    /// T with A~ T : measures[i] = work[i].
    Mat3 conjugate(const std::array<Eigen::Matrix2d, 3>& measures, const Vec3& work) const {
        Mat3 rows;
        for (int i = 0; i < 3; ++i)
            rows.row(i) << measures[i](0, 0), 2.0 * measures[i](0, 1), measures[i](1, 1);
        // Rows of one face are of one size, however small it is.
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

std::vector<FaceStress> sheet_stresses(const Model& model, Index number, const VectorXd& q) {
    const Index flat = static_cast<Index>(model.bodies().sheets().size());
    if (number >= flat) return six_node_stresses(model, number - flat, q);
    const Sheet& sheet = *model.bodies().sheets()[number];
    const MembraneFaces& membrane = model.membrane_faces(number);
    const std::vector<double> turns = sheet_loops::fold_turns(sheet, q.data());
    const auto turn_of = [&](Index fold) { return turns[fold]; };
    const double* rotations = q.data() + model.nodes().first_scalar();
    const MembraneTerm& stretching =
        dynamic_cast<const MembraneTerm&>(model.elastic_term(number, "membrane"));
    const BendingTerm& bending = dynamic_cast<const BendingTerm&>(model.elastic_term(number, "bending"));

    Strains stretches(sheet.n_faces()), bends(sheet.n_faces());
    for (Index f = 0; f < sheet.n_faces(); ++f) {
        const std::array<Vec3, 3> rest = membrane.rest_corners(f);
        Vec3 x[3];
        for (int k = 0; k < 3; ++k) x[k] = q.segment<3>(3 * membrane.corners()[f][k]);
        const Vec3 turned = bending.natural_angle_changes(f);
        const Vec3 change = squared_lengths(x) - (stretching.grows() ? stretching.grown(f).squared_lengths()
                                                                     : squared_lengths(rest.data()));
        for (int i = 0; i < 3; ++i) {
            stretches.set(f, i, change[i]);
            bends.set(f, i, bending_strain(sheet.sides[f][i], turn_of, rotations) - turned[i]);
        }
    }
    const Strains pulls = stretching.stresses(stretches);
    const Strains moments = bending.stresses(bends);

    std::vector<FaceStress> out(sheet.n_faces());
    const auto three = [](const Strains& of, Index f) {
        return Vec3(of.number(f, 0), of.number(f, 1), of.number(f, 2));
    };
    sheet_loops::over_blocks(sheet.n_faces(), [&](Index from, Index to) {
        for (Index f = from; f < to; ++f) {
            const auto measures = [f](const auto& term, const std::array<Vec3, 3>& rest) {
                return term.grows() ? Measures(rest, term.grown(f).face()) : Measures(rest);
            };
            const Measures cut = measures(stretching, membrane.rest_corners(f)),
                           own = measures(bending, sheet.rest_corners(f));
            const auto of_stretch = cut.face().membrane_measures(), of_bend = own.face().bending_measures();
            out[sheet.faces.user[f]] = {
                cut.tensor(of_stretch, three(stretches, f)), own.tensor(of_bend, three(bends, f)),
                cut.conjugate(of_stretch, three(pulls, f)), own.conjugate(of_bend, three(moments, f))};
        }
    });
    return out;
}

}  // namespace magshell
