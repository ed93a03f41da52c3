#include "magshell/scene/shells_rest_gradient.h"

#include <Eigen/LU>

#include "magshell/energy/grown_face.h"
#include "magshell/energy/rest_corners.h"
#include "magshell/strain/dihedral_angle.h"
#include "magshell/terms/shell/bending_term.h"
#include "magshell/terms/shell/membrane_term.h"

namespace magshell {
namespace {

Vec3 strains_of(const Strains& all, Index face) {
    return {all.number(face, 0), all.number(face, 1), all.number(face, 2)};
}

// The strains d of a term, their rates r along lambda, and the stresses C d and C r.
struct StrainState {
    Strains d, r, of_d, of_r;

    StrainState(ElasticTerm& term, const VectorXd& q, const VectorXd& lambda)
        : d(term.strains(q.data())),
          r(term.strain_rates(lambda.data())),
          of_d(term.stresses(d)),
          of_r(term.stresses(r)) {}
};

// Returns the symmetric tensor s with measure_i : s = work_i.
Mat2 stress_of(const std::array<Mat2, 3>& measures, const Vec3& work) {
    Mat3 rows;
    for (int i = 0; i < 3; ++i)
        rows.row(i) << measures[i](0, 0), measures[i](1, 1), measures[i](0, 1) + measures[i](1, 0);
    const Vec3 s = rows.inverse() * work;
    Mat2 stress;
    stress << s[0], s[2], s[2], s[1];
    return stress;
}

// Returns the derivative of r . C d by a deformation that changes the measures as (I - H^T) M_i (I - H), and the area.
Mat2 work_by_deformation(const std::array<Mat2, 3>& measures, const Vec3& r, const Vec3& d, const Vec3& of_r,
                         const Vec3& of_d) {
    Mat2 e_r = Mat2::Zero(), e_d = Mat2::Zero();
    for (int i = 0; i < 3; ++i) {
        e_r += r[i] * measures[i];
        e_d += d[i] * measures[i];
    }
    const Mat2 both = e_r * stress_of(measures, of_d) + e_d * stress_of(measures, of_r);
    return r.dot(of_d) * Mat2::Identity() - both - both.transpose();
}

void add_membrane(MembraneTerm& term, const MembraneFaces& faces, const VectorXd& q, const VectorXd& lambda,
                  VectorXd& out) {
    const StrainState at(term, q, lambda);
    for (Index f = 0; f < term.elements(); ++f) {
        const std::array<Vec3, 3> x = faces.rest_corners(f);
        const GrownFace face(x, Mat3::Identity(), Mat3::Zero());
        const Vec3 of_r = strains_of(at.of_r, f);
        const Mat2 by = work_by_deformation(face.face().membrane_measures(), strains_of(at.r, f),
                                            strains_of(at.d, f), of_r, strains_of(at.of_d, f)) +
                        face.lengths_by_growth(-of_r);
        add_by_rest_corners(RestShape(x), face.in_world(by), faces.corners()[f], out);
    }
}

// The measures are (t_i (x) t_i) / (A~ l~_i) with rotated edges t_i, times the curvature scales s_i of their edges.
void add_bending(BendingTerm& term, const Shell& sheet, const std::vector<Vec3>& rest, const VectorXd& scales,
                 const VectorXd& q, const VectorXd& lambda, VectorXd& out) {
    const StrainState at(term, q, lambda);
    for (Index f = 0; f < sheet.n_faces(); ++f) {
        const std::array<Vec3, 3>& x = sheet.rest_corners(f);
        const GrownFace face(x, Mat3::Identity(), Mat3::Zero());
        const Vec3 scale(scales[sheet.edges[f][0]], scales[sheet.edges[f][1]], scales[sheet.edges[f][2]]);
        const Vec3 r = strains_of(at.r, f), d = strains_of(at.d, f), of_r = strains_of(at.of_r, f),
                   of_d = strains_of(at.of_d, f);
        Mat2 by =
            work_by_deformation(face.face().bending_measures(), scale.cwiseProduct(r), scale.cwiseProduct(d),
                                of_r.cwiseQuotient(scale), of_d.cwiseQuotient(scale)) +
            2.0 * r.dot(of_d) * Mat2::Identity();
        for (int i = 0; i < 3; ++i)
            by -= (r[i] * of_d[i] + d[i] * of_r[i]) * face.triangle().relative_length_by_growth(i);
        add_by_rest_corners(RestShape(x), face.in_world(by), sheet.corners[f], out);
    }
    for (const DihedralStencil& fold : sheet.dihedrals) {
        double moment = 0.0;  // of lambda, against the rest angle
        for (const DihedralStencil::Side& side : {fold.left, fold.right})
            if (side.face >= 0) moment -= fold.weight() * at.of_r.number(side.face, side.corner);
        const DihedralAngle angle(broadcast(rest[fold.nodes[0]]), broadcast(rest[fold.nodes[1]]),
                                  broadcast(rest[fold.nodes[2]]), broadcast(rest[fold.nodes[3]]),
                                  SimdDouble(fold.right_is_point ? 1.0 : 0.0));
        SimdVec3 g[4];
        angle.gradient(g);
        for (int k = 0; k < 4; ++k) out.segment<3>(3 * fold.nodes[k]) += moment * lane_of(g[k], 0);
    }
}

}  // namespace

VectorXd shells_rest_vjp(Model& model, const VectorXd& q, const VectorXd& lambda,
                         const std::vector<VectorXd>& curvature_scales) {
    VectorXd out = VectorXd::Zero(3 * model.nodes().n_nodes());
    const std::vector<const Shell*>& sheets = model.bodies().shells();
    std::size_t membranes = 0, bendings = 0;
    for (const std::unique_ptr<Term>& term : model.terms().energies) {
        if (auto* const membrane = dynamic_cast<MembraneTerm*>(term.get())) {
            add_membrane(*membrane, *model.terms().membrane_faces[membranes++], q, lambda, out);
        } else if (auto* const bending = dynamic_cast<BendingTerm*>(term.get())) {
            add_bending(*bending, *sheets[bendings], model.nodes().rest, curvature_scales[bendings], q,
                        lambda, out);
            ++bendings;
        }
    }
    return out;
}

}  // namespace magshell
