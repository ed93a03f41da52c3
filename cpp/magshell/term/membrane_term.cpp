#include "magshell/term/membrane_term.h"

namespace magshell {

MembraneTerm::MembraneTerm(const Surface& surface, Index body, const FaceLoop& loop, const Nodes& nodes,
                           Registry& registry)
    : StrainScaffold(surface.n_faces()),
      surface_(surface),
      body_(body),
      loop_(loop),
      nodes_(nodes.n_nodes()),
      materials_(surface, registry),
      elements_(loop.packs()) {
    for (Index pack = 0; pack < loop.packs(); ++pack)
        for (int lane = 0; lane < Pack::width; ++lane) {
            const std::array<Vec3, 3>& x = surface.rest_corners(loop.face(pack, lane));
            for (int i = 0; i < 3; ++i)
                elements_[pack].rest_squared_length[i].set(lane,
                                                           (x[(i + 2) % 3] - x[(i + 1) % 3]).squaredNorm());
        }
}

bool MembraneTerm::set_values(const Values& values) {
    if (!materials_.set_values(values)) return false;
    for (Index pack = 0; pack < loop_.packs(); ++pack)
        for (int lane = 0; lane < Pack::width; ++lane) {
            const Index f = loop_.face(pack, lane);
            set_lane(elements_[pack].stiffness, lane,
                     RestFace(surface_.rest_corners(f).data()).membrane_stiffness(materials_[f]));
        }
    return true;
}

double MembraneTerm::energy(const double* q, const Controls&) const {
    return loop_.sum([&](Index pack) {
        Pack3 x[3];
        loop_.gather(pack, q, x);
        Pack strain[3], stress[3];
        Membrane(x).strain(elements_[pack], strain);
        elements_[pack].stiffness.times(strain, stress);
        return Pack(0.5) * (strain[0] * stress[0] + strain[1] * stress[1] + strain[2] * stress[2]);
    });
}

void MembraneTerm::evaluate(const double* q, const Controls&, Residual& out) {
    state_.assign(q, q + 3 * nodes_);
    loop_.scatter_packs([&](Index pack) {
        Pack3 x[3], g[3];
        loop_.gather(pack, q, x);
        const Membrane membrane(x);
        Pack strain[3];
        membrane.strain(elements_[pack], strain);
        keep_stress(pack, strain);
        membrane.gradient(stress_.at(pack), g);
        loop_.scatter(pack, g, out);
    });
}

void MembraneTerm::assemble(const Part& part, const double* q, const Controls&, bool extrapolated_stress,
                            SystemMatrix& out) const {
    const Strains& stress = extrapolated_stress ? extrapolated_ : stress_;
    FaceLoop::over_packs(part, [&](Index pack) {
        Pack3 x[3];
        Pack33 h[6];
        loop_.gather(pack, q, x);
        Membrane(x).hessian(history_.scaled(elements_[pack].stiffness), stress.at(pack), h);
        loop_.scatter(pack, h, out);
    });
}

void MembraneTerm::strain(Index pack, const double* q, Pack d[3]) const {
    Pack3 x[3];
    loop_.gather(pack, q, x);
    Membrane(x).strain(elements_[pack], d);
}

void MembraneTerm::rate(Index pack, const double* p, Pack d[3]) const {
    Pack3 x[3], along[3];
    loop_.gather(pack, state_.data(), x);
    loop_.gather(pack, p, along);
    Membrane(x).strain_rate(along, d);
}

void MembraneTerm::vjp(const double* q, const Controls&, const double* lambda, Gradient& out) {
    loop_.each_pack([&](Index pack) {
        Pack d[3], along[3];
        strain(pack, q, d);
        history_.apply(pack, d);
        rate(pack, lambda, along);
        for (int lane = 0; lane < loop_.lanes_in(pack); ++lane) {
            const Index f = loop_.face(pack, lane);
            const Mat3 by_poisson_ratio =
                RestFace(surface_.rest_corners(f).data()).membrane_by_poisson_ratio(materials_[f]);
            const Vec3 rates = lane_of(along, lane);
            materials_.add_vjp(f, 1, rates.dot(lane_of(stress_.at(pack), lane)),
                               rates.dot(by_poisson_ratio * lane_of(d, lane)), out);
        }
    });
}

void MembraneTerm::add_forces(const Strains& stresses, Residual& out) {
    loop_.scatter_packs([&](Index pack) {
        Pack3 x[3], g[3];
        loop_.gather(pack, state_.data(), x);
        Membrane(x).gradient(stresses.at(pack), g);
        loop_.scatter(pack, g, out);
    });
}

// |a|^2 carries its own round-off, and that of the positions whose difference a is: far from the origin, or
// beside long radii, the larger one.
void MembraneTerm::add_cancelling_forces(double beyond, VectorXd& out) const {
    for (Index f = 0; f < surface_.n_faces(); ++f) {
        const Membrane::Element& element = elements_[f / Pack::width];
        const int lane = f % Pack::width;
        const double coordinate = surface_.largest_coordinate(f) + beyond;
        for (int i = 0; i < 3; ++i) {
            double stress = 0.0;
            for (int j = 0; j < 3; ++j) {
                const double squared_length = element.rest_squared_length[j][lane];
                stress += std::abs(element.stiffness(i, j)[lane]) *
                          (squared_length + 0.25 * std::sqrt(squared_length) * coordinate);
            }
            const double force = 2.0 * stress * std::sqrt(element.rest_squared_length[i][lane]);
            for (const int k : {(i + 1) % 3, (i + 2) % 3})
                out.segment<3>(3 * surface_.corners[f][k]).array() += force;
        }
    }
}

std::size_t MembraneTerm::bytes() const {
    return materials_.bytes() + bytes_of(elements_) + bytes_of_stresses() + bytes_of(state_);
}

}  // namespace magshell
