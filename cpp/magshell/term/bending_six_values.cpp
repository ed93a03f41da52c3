// What values are to the bending of six-node faces: materials, growth and rest curvature, and the gradient by them.
#include "magshell/term/bending_six_term.h"

namespace magshell {

bool BendingSixTerm::set_values(const Values& values) {
    const bool material_changed = materials_.set_values(values), grew = growth_.set_values(values);
    if (!material_changed && !grew) return false;
    if (grew) grow();
    for (Index pack = 0; pack < loop_.packs(); ++pack)
        for (int lane = 0; lane < Pack::width; ++lane) {
            const Index f = loop_.element(pack, lane);
            set_lane(stiffness_[pack], lane, rest_[f].bending_stiffness(materials_[f]));
        }
    return true;
}

Vec9 BendingSixTerm::rest_angles(Index face) const {
    Vec9 angles = Vec9::Zero();
    for (int i = 0; i < 3; ++i) {
        const FaceSideSix& side = sheet_.sides[face][i];
        for (int g = 0; g < 2 && side.dihedral >= 0; ++g)
            angles[3 * i + g] = side.weight * sheet_.dihedrals[side.dihedral].rest_angle[side.point(g)];
    }
    return angles;
}

// Turns of folds are measured from their rest angles already.
void BendingSixTerm::grow() {
    for (Index pack = 0; pack < loop_.packs(); ++pack)
        for (int lane = 0; lane < Pack::width; ++lane) {
            const Index f = loop_.element(pack, lane);
            const GrownSix face = grown(f);
            rest_[f] = face.face();
            for (int p = 0; p < BendingSix::points; ++p)
                elements_[pack].inverse_jacobian[p].set(lane, rest_[f].inverse_jacobian[p]);
            const Vec9 angles = rest_angles(f);
            const Vec9 natural = face.rest().cwiseProduct(rest_inside_[f] + angles) + face.bent() - angles;
            for (int r = 0; r < 9; ++r) {
                elements_[pack].scale[r].set(lane, rest_[f].scale[r]);
                rest_measures_[pack][r].set(lane, natural[r]);
            }
        }
}

// Of by . d in a fixed shape, which inside has `inside`.
GrownFace::ByNatural BendingSixTerm::strains_by_growth(const GrownSix& face, Index number, const Vec9& by,
                                                       const Vec9& inside) const {
    GrownFace::ByNatural found = face.natural_by_growth(-by, rest_inside_[number] + rest_angles(number));
    found.growth += face.inside_by_growth(by, inside);
    return found;
}

void BendingSixTerm::vjp(const double* q, const Controls&, const double* lambda, Gradient& out) {
    store_rates(lambda);
    std::vector<Eigen::Vector2d> of_faces(sheet_.n_faces());
    each_pack([&](Index pack) {
        Pack d[9], along[9];
        strain(pack, q, d);
        history_.apply<9>(pack, d);
        rate(pack, lambda, along);
        for (int lane = 0; lane < loop_.lanes_in(pack); ++lane) {
            const Index f = loop_.element(pack, lane);
            const Eigen::Vector<double, 9> rates = lane_of<9>(along, lane);
            of_faces[f] = {rates.dot(lane_of<9>(stress_.at(pack), lane)),
                           rates.dot(rest_[f].bending_by_poisson_ratio(materials_[f]) * lane_of<9>(d, lane))};
        }
    });
    for (Index f = 0; f < sheet_.n_faces(); ++f)
        materials_.add_vjp(f, 3, of_faces[f][0], of_faces[f][1], out);
    if (growth_.any()) add_growth_vjp(q, lambda, out);
}

void BendingSixTerm::add_growth_vjp(const double* q, const double* lambda, Gradient& out) const {
    std::vector<GrownFace::ByNatural> by_faces(sheet_.n_faces());
    each_pack([&](Index pack) {
        Pack3 x[6], p[6];
        Pack now[9], along_inside[9], d[9], along[9], stresses[9];
        SixNodeRows rows;
        loop_.gather(pack, q, x);
        loop_.gather(pack, lambda, p);
        const BendingSix inside(x);
        inside.measures(elements_[pack], now);
        inside.rows(elements_[pack], rows);
        rows.along(p, along_inside);
        strain(pack, q, d);
        history_.apply<9>(pack, d);
        rate(pack, lambda, along);
        stiffness_[pack].times(along, stresses);
        for (int lane = 0; lane < loop_.lanes_in(pack); ++lane) {
            const Index f = loop_.element(pack, lane);
            const GrownSix face = grown(f);
            GrownFace::ByNatural& by = by_faces[f];
            by = strains_by_growth(face, f, history_.factor() * lane_of<9>(stresses, lane),
                                   lane_of<9>(now, lane));
            by.growth +=
                face.bending_by_growth(materials_[f], lane_of<9>(along, lane), lane_of<9>(d, lane)) +
                face.inside_by_growth(lane_of<9>(stress_.at(pack), lane), lane_of<9>(along_inside, lane));
        }
    });
    for (Index f = 0; f < sheet_.n_faces(); ++f) {
        const GrownSix face = grown(f);
        growth_.add_vjp(f, face.in_world(by_faces[f].growth), face.in_world(by_faces[f].curvature), out);
    }
}

void BendingSixTerm::strains_vjp(const Strains& stresses, Gradient& out) const {
    if (!growth_.any()) return;
    for (Index pack = 0; pack < loop_.packs(); ++pack) {
        Pack3 x[6];
        Pack now[9];
        loop_.gather(pack, state_.data(), x);
        BendingSix(x).measures(elements_[pack], now);
        for (int lane = 0; lane < loop_.lanes_in(pack); ++lane) {
            const Index f = loop_.element(pack, lane);
            const GrownSix face = grown(f);
            Vec9 by;
            for (int r = 0; r < 9; ++r) by[r] = stresses.number(f, r);
            const GrownFace::ByNatural found = strains_by_growth(face, f, by, lane_of<9>(now, lane));
            growth_.add_vjp(f, face.in_world(found.growth), face.in_world(found.curvature), out);
        }
    }
}

}  // namespace magshell
