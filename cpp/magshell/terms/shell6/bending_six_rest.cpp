// The gradient of the bending energy of quadratic triangles by rest positions.
//
// With the strains d = f(q) - f~ + angles and their rates r, a face takes from its rest shape: the factors 1/J~ and s of f
// (energy/bending_six.h), the measures f~, the rest angles, and C = S^-1 (energy/six_node_face.h), so that for fixed r and d
//
//   r . dC d = - (C r) . dS (C d)
#include "magshell/energy/rest_point_six.h"
#include "magshell/terms/shell6/bending_six_term.h"
#include "magshell/terms/shell6/grown_rest_nodes.h"

namespace magshell {
namespace {

// Computes the measures inside the faces of a SIMD vector at one point after another, by a function of the point and the measures there with
// 1/J = 1.
template <class OfPoint>
void each_point(const BendingSix::Element& element, const OfPoint& of_point) {
    BendingSix::Element unit = element;
    for (SimdDouble& each : unit.inverse_jacobian) each = SimdDouble(0.0);
    for (int point = 0; point < BendingSix::points; ++point) {
        unit.inverse_jacobian[point] = SimdDouble(1.0);
        of_point(point, unit);
        unit.inverse_jacobian[point] = SimdDouble(0.0);
    }
}

}  // namespace

void BendingSixTerm::add_rest_vjp(const double* q, const LoadParameters&, const double* lambda,
                                  VectorXd& out) {
    if (growth_.any()) {
        add_grown_rest_vjp(q, lambda, out);
        return;
    }
    Strains by_strains(shell_.n_faces(), 9);
    std::vector<ByRestFace> by_faces(shell_.n_faces());
    std::vector<Vec9> of_rates(shell_.n_faces()), of_strains(shell_.n_faces());
    each_group([&](Index group) {
        SimdVec3 x[6], p[6];
        SimdDouble d[9], along[9], stresses[9], inside[9];
        SixNodeRows rows;
        loop_.gather(group, q, x);
        loop_.gather(group, lambda, p);
        strain(group, q, d);
        history_.apply<9>(group, d);
        rate(group, lambda, along);
        stiffness_[group].times(along, stresses);
        SimdDouble* const by = by_strains.at(group);
        for (int r = 0; r < 9; ++r) by[r] = SimdDouble(history_.factor()) * stresses[r];
        const BendingSix now(x);
        ByRestFace found[SimdDouble::width];
        strains_by_rest(group, now, by, found);
        const SimdDouble* const of_d = stress_.at(group);
        // The rates inside the face depend on 1/J~ and s as the strains do.
        BendingSix::Element unit = elements_[group];
        for (SimdDouble& each : unit.inverse_jacobian) each = SimdDouble(0.0);
        for (int point = 0; point < BendingSix::points; ++point) {
            unit.inverse_jacobian[point] = SimdDouble(1.0);
            now.rows(unit, rows);
            rows.along(p, inside);
            unit.inverse_jacobian[point] = SimdDouble(0.0);
            for (int lane = 0; lane < loop_.lanes_in(group); ++lane) {
                const Vec9 power = lane_of<9>(of_d, lane).cwiseProduct(lane_of<9>(inside, lane));
                const double own = elements_[group].inverse_jacobian[point][lane];
                found[lane].inverse_jacobian[point] += power.sum();
                for (int r = 0; r < 9; ++r)
                    found[lane].scale[r] += own * power[r] / elements_[group].scale[r][lane];
            }
        }
        for (int lane = 0; lane < loop_.lanes_in(group); ++lane) {
            const Index f = loop_.element(group, lane);
            of_rates[f] = lane_of<9>(stresses, lane);
            of_strains[f] = lane_of<9>(of_d, lane);
            for (int r = 0; r < 9; ++r)
                found[lane].scale[r] -= (of_rates[f][r] * d[r][lane] + of_strains[f][r] * along[r][lane]) /
                                        elements_[group].scale[r][lane];
            by_faces[f] = found[lane];
        }
    });
    for (Index f = 0; f < shell_.n_faces(); ++f) {
        for (const six_nodes::Point& point : six_nodes::inside) {
            const RestPointSix rest(shell_.rest[f], point.at);
            const GrownFace face(rest.corners(), Mat3::Identity(), Mat3::Zero());
            const Mat2 by = compliance_by_deformation(f, face.triangle(), point.at, point.weight, of_rates[f],
                                                      of_strains[f]);
            rest.add_by_deformation(face.in_world(-by), shell_.own_nodes[f], out);
        }
        add_rest_face(f, rest_[f], by_faces[f], out);
    }
    add_rest_angles(by_strains, out);
}

// The derivatives of d are those of f' at the present shape, by the grown 1/J' and s', minus those of the natural measures.
void BendingSixTerm::add_grown_strains_by_rest(Index group, const BendingSix& now,
                                               const Vec9 by[SimdDouble::width],
                                               GrownSixRest* const of_faces[SimdDouble::width],
                                               VectorXd& out) const {
    const BendingSix::Element& element = elements_[group];
    each_point(element, [&](int point, const BendingSix::Element& unit) {
        SimdDouble here[9];
        now.measures(unit, here);
        for (int lane = 0; lane < loop_.lanes_in(group); ++lane) {
            const Vec9 power = by[lane].cwiseProduct(lane_of<9>(here, lane));
            of_faces[lane]->add_inverse_jacobian(point, power.sum());
            of_faces[lane]->add_scale(element.inverse_jacobian[point][lane] * power);
        }
    });
    SimdVec3 x[6], by_node[6];
    for (int lane = 0; lane < SimdDouble::width; ++lane)
        for (int k = 0; k < 6; ++k) set_lane(x[k], lane, shell_.rest[loop_.element(group, lane)][k]);
    const BendingSix at_rest(x);
    BendingSix::Element reference;
    SimdDouble by_reference[9];
    std::vector<SixNodeFace> faces;
    for (int lane = 0; lane < SimdDouble::width; ++lane) {
        const Index f = loop_.element(group, lane);
        const SixNodeFace& face = faces.emplace_back(shell_.rest[f]);
        for (int p = 0; p < BendingSix::points; ++p)
            reference.inverse_jacobian[p].set(lane, face.inverse_jacobian[p]);
        const bool counts = lane < loop_.lanes_in(group);
        const Vec9 factors = counts ? grown(f).reference_factors() : Vec9::Zero().eval();
        for (int r = 0; r < 9; ++r) {
            reference.scale[r].set(lane, face.scale[r]);
            by_reference[r].set(lane, counts ? -by[lane][r] * factors[r] : 0.0);
        }
        if (counts) of_faces[lane]->add_natural(-by[lane], reference_interior_[f] + rest_angles(f));
    }
    SixNodeRows rows;
    at_rest.rows(reference, rows);
    rows.forces(by_reference, by_node);
    ByRestFace found[SimdDouble::width];
    each_point(reference, [&](int point, const BendingSix::Element& unit) {
        SimdDouble there[9];
        at_rest.measures(unit, there);
        for (int lane = 0; lane < loop_.lanes_in(group); ++lane) {
            const Vec9 power = lane_of<9>(by_reference, lane).cwiseProduct(lane_of<9>(there, lane));
            found[lane].inverse_jacobian[point] += power.sum();
            for (int r = 0; r < 9; ++r)
                found[lane].scale[r] +=
                    reference.inverse_jacobian[point][lane] * power[r] / reference.scale[r][lane];
        }
    });
    for (int lane = 0; lane < loop_.lanes_in(group); ++lane) {
        const Index f = loop_.element(group, lane);
        for (int k = 0; k < 6; ++k) found[lane].nodes[k] = lane_of(by_node[k], lane);
        found[lane].scale += add_rest_nodes(*of_faces[lane], growth_, f, shell_.own_nodes[f], out);
        add_rest_face(f, faces[lane], found[lane], out);
    }
}

void BendingSixTerm::add_grown_rest_vjp(const double* q, const double* lambda, VectorXd& out) {
    store_rates(lambda);
    Strains by_angles(shell_.n_faces(), 9);
    for (Index group = 0; group < loop_.groups(); ++group) {
        SimdVec3 x[6], p[6];
        SimdDouble d[9], along[9], stresses[9], inside[9];
        SixNodeRows rows;
        loop_.gather(group, q, x);
        loop_.gather(group, lambda, p);
        strain(group, q, d);
        history_.apply<9>(group, d);
        rate(group, lambda, along);
        stiffness_[group].times(along, stresses);
        const BendingSix now(x);
        std::vector<GrownSix> faces;
        std::vector<GrownSixRest> by_faces;
        Vec9 by_strains[SimdDouble::width];
        GrownSixRest* of_faces[SimdDouble::width] = {};
        faces.reserve(SimdDouble::width);
        by_faces.reserve(SimdDouble::width);
        for (int lane = 0; lane < loop_.lanes_in(group); ++lane) {
            const Index f = loop_.element(group, lane);
            const GrownSix& face = faces.emplace_back(grown(f));
            of_faces[lane] = &by_faces.emplace_back(face);
            const Vec9 of_r = lane_of<9>(stresses, lane), of_d = lane_of<9>(stress_.at(group), lane);
            by_strains[lane] = history_.factor() * of_r;
            of_faces[lane]->add_compliance(materials_[f], of_r, of_d);
            of_faces[lane]->add_scale(
                -(of_r.cwiseProduct(lane_of<9>(d, lane)) + of_d.cwiseProduct(lane_of<9>(along, lane))));
            const Vec9 by_angle = by_strains[lane].cwiseProduct(face.reference_factors());
            for (int r = 0; r < 9; ++r) by_angles.set(f, r, by_angle[r]);
        }
        // The rates inside the face depend on 1/J' and s' as the strains do.
        each_point(elements_[group], [&](int point, const BendingSix::Element& unit) {
            now.rows(unit, rows);
            rows.along(p, inside);
            for (int lane = 0; lane < loop_.lanes_in(group); ++lane) {
                const Vec9 power = lane_of<9>(stress_.at(group), lane).cwiseProduct(lane_of<9>(inside, lane));
                of_faces[lane]->add_inverse_jacobian(point, power.sum());
                of_faces[lane]->add_scale(elements_[group].inverse_jacobian[point][lane] * power);
            }
        });
        add_grown_strains_by_rest(group, now, by_strains, of_faces, out);
    }
    add_rest_angles(by_angles, out);
}

void BendingSixTerm::add_rest_strains_vjp(const Strains& by_strains, VectorXd& out) const {
    Strains by_angles = by_strains;
    for (Index group = 0; group < loop_.groups(); ++group) {
        SimdVec3 x[6];
        loop_.gather(group, state_.data(), x);
        if (growth_.any()) {
            std::vector<GrownSix> faces;
            std::vector<GrownSixRest> by_faces;
            Vec9 by[SimdDouble::width];
            GrownSixRest* of_faces[SimdDouble::width] = {};
            faces.reserve(SimdDouble::width);
            by_faces.reserve(SimdDouble::width);
            for (int lane = 0; lane < loop_.lanes_in(group); ++lane) {
                const Index f = loop_.element(group, lane);
                of_faces[lane] = &by_faces.emplace_back(faces.emplace_back(grown(f)));
                by[lane] = lane_of<9>(by_strains.at(group), lane);
                const Vec9 by_angle = by[lane].cwiseProduct(faces.back().reference_factors());
                for (int r = 0; r < 9; ++r) by_angles.set(f, r, by_angle[r]);
            }
            add_grown_strains_by_rest(group, BendingSix(x), by, of_faces, out);
            continue;
        }
        ByRestFace found[SimdDouble::width];
        strains_by_rest(group, BendingSix(x), by_strains.at(group), found);
        for (int lane = 0; lane < loop_.lanes_in(group); ++lane)
            add_rest_face(loop_.element(group, lane), rest_[loop_.element(group, lane)], found[lane], out);
    }
    add_rest_angles(by_angles, out);
}

void BendingSixTerm::strains_by_rest(Index group, const BendingSix& now, const SimdDouble by[9],
                                     ByRestFace out[SimdDouble::width]) const {
    SimdVec3 x[6], by_node[6];
    SimdDouble here[9], there[9], against[9];
    SixNodeRows rows;
    for (int lane = 0; lane < SimdDouble::width; ++lane)
        for (int k = 0; k < 6; ++k) set_lane(x[k], lane, shell_.rest[loop_.element(group, lane)][k]);
    const BendingSix rest(x);
    for (int r = 0; r < 9; ++r) against[r] = -by[r];
    rest.rows(elements_[group], rows);
    rows.forces(against, by_node);
    for (int lane = 0; lane < SimdDouble::width; ++lane)
        for (int k = 0; k < 6; ++k) out[lane].nodes[k] = lane_of(by_node[k], lane);
    BendingSix::Element unit = elements_[group];
    for (SimdDouble& each : unit.inverse_jacobian) each = SimdDouble(0.0);
    for (int point = 0; point < BendingSix::points; ++point) {
        unit.inverse_jacobian[point] = SimdDouble(1.0);
        now.measures(unit, here);
        rest.measures(unit, there);
        unit.inverse_jacobian[point] = SimdDouble(0.0);
        for (int lane = 0; lane < SimdDouble::width; ++lane) {
            const double own = elements_[group].inverse_jacobian[point][lane];
            for (int r = 0; r < 9; ++r) {
                const double power = by[r][lane] * (here[r][lane] - there[r][lane]);
                out[lane].inverse_jacobian[point] += power;
                out[lane].scale[r] += own * power / elements_[group].scale[r][lane];
            }
        }
    }
}

// A deformation I + H at a point changes 1/J~ by - tr H / J~. s is twice the length of an edge at its Gauss points, or of its chord.
void BendingSixTerm::add_rest_face(Index f, const SixNodeFace& at_rest, const ByRestFace& by,
                                   VectorXd& out) const {
    const std::array<Vec3, 6>& rest = shell_.rest[f];
    const std::array<Index, 6>& nodes = shell_.own_nodes[f];
    for (int k = 0; k < 6; ++k) out.segment<3>(3 * nodes[k]) += by.nodes[k];
    for (int p = 0; p < BendingSix::points; ++p) {
        const RestPointSix point(rest, six_nodes::inside[p].at);
        const RestShape shape(point.corners());
        const double less = -by.inverse_jacobian[p] * at_rest.inverse_jacobian[p];
        point.add_by_edges({less * shape.gradients[1], less * shape.gradients[2]}, nodes, out);
    }
    const auto add_length = [&](const std::array<int, 3>& of, const std::array<double, 3>& factors,
                                double by_length) {
        Vec3 along = Vec3::Zero();
        for (int k = 0; k < 3; ++k) along += factors[k] * (rest[of[k]] - rest[of[0]]);
        const Vec3 by_vector = by_length * along.normalized();
        for (int k = 0; k < 3; ++k) out.segment<3>(3 * nodes[of[k]]) += factors[k] * by_vector;
    };
    for (int i = 0; i < 3; ++i) {
        const std::array<int, 3> of = {(i + 1) % 3, (i + 2) % 3, six_nodes::middle(i)};
        for (int g = 0; g < 2; ++g)
            add_length(of, six_nodes::along(six_nodes::gauss[g]), 2.0 * by.scale[3 * i + g]);
        add_length(of, {-1.0, 1.0, 0.0}, 2.0 * by.scale[3 * i + 2]);
    }
}

void BendingSixTerm::add_rest_angles(const Strains& by_strains, VectorXd& out) const {
    VectorXd q(3 * nodes_.n_nodes());
    for (Index node = 0; node < nodes_.n_nodes(); ++node) q.segment<3>(3 * node) = nodes_.rest[node];
    const Index n = shell_.n_dihedrals();
    for (Index first = 0; first < n; first += SimdDouble::width) {
        const Index last = std::min<Index>(first + SimdDouble::width, n);
        for (int g = 0; g < 2; ++g) {
            SimdVec3 by_node[9];
            dihedrals_at(first, last, g, q.data()).gradient(by_node);
            for (Index h = first; h < last; ++h) {
                const double by_angle = -moment(shell_.dihedrals[h], g, by_strains);
                for (int a = 0; a < 9; ++a)
                    if (const Index node = shell_.dihedrals[h].nodes[a]; node >= 0)
                        out.segment<3>(3 * node) += by_angle * lane_of(by_node[a], h - first);
            }
        }
    }
}

// Returns the derivative of of_r . S of_d at a point by a deformation of its tangent plane, as GrownSix::bending_by_growth does for
// growth: the moments' directions T = - sym(t_j (x) t_k) / J^2 become (I + H) T (I + H^T) / (1 + tr H)^2, the area (1 + tr H) times as
// large.
Mat2 BendingSixTerm::compliance_by_deformation(Index f, const GrownTriangle& triangle,
                                               const std::array<double, 3>& at, double weight,
                                               const Vec9& of_r, const Vec9& of_d) const {
    const ShellMaterial& m = materials_[f];
    const std::array<Eigen::Vector2d, 3>& t = triangle.edge;
    const double jacobian = std::abs(t[0].x() * t[1].y() - t[0].y() * t[1].x());
    const std::array<double, 9> tests = rest_[f].tests(at);
    Mat2 moment_r = Mat2::Zero(), moment_d = Mat2::Zero();
    for (int a = 0; a < 9; ++a) {
        const Mat2 direction =
            -tests[a] * symmetric_product(t[(a / 3 + 1) % 3], t[(a / 3 + 2) % 3]) / (jacobian * jacobian);
        moment_r += of_r[a] * direction;
        moment_d += of_d[a] * direction;
    }
    const double factor =
        12.0 / (m.young_modulus * m.thickness * m.thickness * m.thickness) * 0.5 * weight * jacobian;
    const auto strain = [&](const Mat2& moment) -> Mat2 {
        return factor *
               ((1.0 + m.poisson_ratio) * moment - m.poisson_ratio * moment.trace() * Mat2::Identity());
    };
    const Mat2 strain_d = strain(moment_d), both = moment_r * strain_d + moment_d * strain(moment_r);
    return both + both.transpose() - 3.0 * moment_r.cwiseProduct(strain_d).sum() * Mat2::Identity();
}

}  // namespace magshell
