// The gradient of the membrane energy of quadratic triangles by rest positions.
#include "magshell/energy/rest_point_six.h"
#include "magshell/terms/shell6/grown_rest_nodes.h"
#include "magshell/terms/shell6/membrane_six_term.h"

namespace magshell {

void MembraneSixTerm::add_rest_vjp(const double* q, const LoadParameters&, const double* lambda,
                                   VectorXd& out) {
    Strains by_measures(shell_.n_faces(), 9);
    std::vector<Vec9> strains(shell_.n_faces()), rates(shell_.n_faces());
    each_group([&](Index group) {
        SimdDouble d[9], along[9], stresses[9];
        strain(group, q, d);
        history_.apply<9>(group, d);
        rate(group, lambda, along);
        stiffness_[group].times(along, stresses);
        for (int r = 0; r < 9; ++r) by_measures.at(group)[r] = SimdDouble(-history_.factor()) * stresses[r];
        for (int lane = 0; lane < loop_.lanes_in(group); ++lane) {
            strains[loop_.element(group, lane)] = lane_of<9>(d, lane);
            rates[loop_.element(group, lane)] = lane_of<9>(along, lane);
        }
    });
    for (Index f = 0; growth_.any() && f < shell_.n_faces(); ++f) {
        const GrownSix face = grown(f);
        GrownSixRest by(face);
        by.add_membrane(materials_[f], rates[f], strains[f]);
        add_rest_nodes(by, growth_, f, shell_.own_nodes[f], out);
    }
    for (Index f = 0; !growth_.any() && f < shell_.n_faces(); ++f)
        for (const six_nodes::Point& point : six_nodes::inside) {
            const RestPointSix rest(shell_.rest[f], point.at);
            const GrownFace face(rest.corners(), Mat3::Identity(), Mat3::Zero());
            const Eigen::Matrix<double, 3, 9> rows = membrane_interpolation(point.at);
            const Mat2 by =
                face.triangle().membrane_by_growth(materials_[f], rows * rates[f], rows * strains[f]);
            rest.add_by_deformation(point.weight * face.in_world(by), shell_.own_nodes[f], out);
        }
    add_rest_measures_vjp(by_measures, out);
}

void MembraneSixTerm::add_rest_strains_vjp(const Strains& stresses, VectorXd& out) const {
    Strains by_measures(shell_.n_faces(), 9);
    for (std::size_t k = 0; k < stresses.groups.size(); ++k) by_measures.groups[k] = -stresses.groups[k];
    add_rest_measures_vjp(by_measures, out);
}

void MembraneSixTerm::add_rest_measures_vjp(const Strains& by_measures, VectorXd& out) const {
    if (growth_.any()) {
        for (Index f = 0; f < shell_.n_faces(); ++f) {
            const GrownSix face = grown(f);
            GrownSixRest by(face);
            Vec9 of_face;
            for (int r = 0; r < 9; ++r) of_face[r] = by_measures.number(f, r);
            by.add_lengths(of_face);
            add_rest_nodes(by, growth_, f, shell_.own_nodes[f], out);
        }
        return;
    }
    for (Index group = 0; group < loop_.groups(); ++group) {
        SimdVec3 x[6], by_node[6];
        SixNodeRows rows;
        for (int lane = 0; lane < SimdDouble::width; ++lane)
            for (int k = 0; k < 6; ++k) set_lane(x[k], lane, shell_.rest[loop_.element(group, lane)][k]);
        MembraneSix(x).rows(rows);
        rows.forces(by_measures.at(group), by_node);
        for (int lane = 0; lane < loop_.lanes_in(group); ++lane)
            for (int k = 0; k < 6; ++k)
                out.segment<3>(3 * shell_.own_nodes[loop_.element(group, lane)][k]) +=
                    lane_of(by_node[k], lane);
    }
}

}  // namespace magshell
