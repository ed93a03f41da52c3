#include "magshell/terms/shell6/magnetic_six_term.h"

#include <Eigen/LU>

#include "magshell/assembly/element_loop.h"
#include "magshell/energy/magnetic.h"
#include "magshell/energy/magnetic_rotating.h"
#include "magshell/energy/magnetic_six.h"
#include "magshell/energy/rest_point_six.h"
#include "magshell/energy/rotating_rest.h"
#include "magshell/terms/element_energies.h"
#include "magshell/terms/magnetic/applied_field_term.h"
#include "magshell/terms/magnetic/field_groups.h"
#include "magshell/terms/magnetic/total_applied_field.h"
#include "magshell/terms/rest_shape_term.h"

namespace magshell {
namespace {

template <class Law>
class MagneticSixTerm final : public AppliedFieldTerm, public ElementEnergies, public RestShapeTerm {
  public:
    MagneticSixTerm(const SixNodeShell& shell, Index body, const ColoredLoop& element_blocks,
                    const SystemMatrix& matrix, const FieldSources& sources, Registry& registry);

    std::string_view name() const override { return Magnetic::name; }
    void add_rest_vjp(const double* q, const LoadParameters&, const double* lambda, VectorXd& out) override;
    Index body() const override { return body_; }
    bool set_values(const Values& values) override;
    double energy(const double* q, const LoadParameters& load_parameters) const override {
        return loop_.sum(energy_of_group(q, load_parameters));
    }
    std::vector<double> element_energies(const double* q,
                                         const LoadParameters& load_parameters) const override {
        return of_elements(loop_, shell_.faces.user, energy_of_group(q, load_parameters));
    }
    void evaluate(const double* q, const LoadParameters& load_parameters, Residual& out) override;
    void prepare_assembly(const double* q, const LoadParameters& load_parameters) override;
    void assemble(const ElementBlock& element_block, const double* q, const LoadParameters& load_parameters,
                  bool, SystemMatrix& out) const override;
    void vjp(const double* q, const LoadParameters& load_parameters, const double* lambda,
             Gradient& out) override;
    void add_moments(const double* q, const LoadParameters& load_parameters, std::vector<Vec3>& places,
                     std::vector<Vec3>& moments) const override;
    std::size_t bytes() const override;

  private:
    using Point = MagneticSix<Law>;
    static constexpr int points = Point::points;
    struct Points {
        typename Law::Element at[points];
    };
    using Fields = PointFields<points>;

    // Returns the edge vectors (a~_1, a~_2) of the tangent plane at a point of a face.
    std::array<Vec3, 2> rest_edges(Index face, int point) const;
    // Computes the positions [m] and magnetizations [A/m] of all points, face by face.
    void find_points(const double* q, std::vector<Vec3>& places, std::vector<Vec3>& magnetizations) const;
    // Returns the applied field at all points in SIMD vectors; empty in a uniform field. Order as in
    // AppliedField::add_samples.
    std::vector<Fields> sample(const double* q, const LoadParameters& load_parameters, int order) const;
    // Returns a function of a SIMD vector that computes the energies [J] of its faces.
    auto energy_of_group(const double* q, const LoadParameters& load_parameters) const {
        return [this, q, fields = sample(q, load_parameters, 0),
                everywhere = broadcast(field_.uniform(load_parameters))](Index group) {
            SimdVec3 x[6];
            loop_.gather(group, q, x);
            SimdDouble total(0.0);
            for (int p = 0; p < points; ++p) {
                const typename Law::Element& e = elements_[group].at[p];
                total +=
                    Point(x, p, e).frame().energy(e, fields.empty() ? everywhere : fields[group].at[p].flux);
            }
            return total;
        };
    }

    const SixNodeShell& shell_;
    const Index body_;
    const ElementLoop<6> loop_;
    const TotalAppliedField field_;
    ParameterSlice magnetization_, thickness_;  // values
    std::vector<double> thicknesses_;
    std::vector<Points> elements_;
    // The gradient with respect to the magnetization of each point, and the applied field there, from the last vjp().
    std::vector<Vec3> by_magnetization_;
    std::vector<FluxAndRate> applied_;
    std::vector<Fields> fields_;  // sampled for the current assembly; empty in a uniform field
    bool linear_ = true;          // every magnetization is linear in the positions
};

template <class Law>
MagneticSixTerm<Law>::MagneticSixTerm(const SixNodeShell& shell, Index body,
                                      const ColoredLoop& element_blocks, const SystemMatrix& matrix,
                                      const FieldSources& sources, Registry& registry)
    : shell_(shell),
      body_(body),
      loop_(shell.own_nodes, element_blocks, matrix),
      field_(sources, registry),
      magnetization_(registry.values.add(shell.owner, "remanent_magnetization", "A/m", shell.n_faces(), 3,
                                         &shell.faces)),
      thickness_(registry.values.add(shell.owner, "thickness", "m", shell.n_faces(), 1, &shell.faces)),
      elements_(loop_.groups()) {}

template <class Law>
std::array<Vec3, 2> MagneticSixTerm<Law>::rest_edges(Index face, int point) const {
    const std::array<double, 3>& at = six_nodes::inside[point].at;
    const std::array<double, 6> first = six_nodes::derivative(2, at), second = six_nodes::derivative(1, at);
    Vec3 a1 = Vec3::Zero(), a2 = Vec3::Zero();
    for (int k = 0; k < 6; ++k) {
        a1 += first[k] * shell_.rest[face][k];
        a2 -= second[k] * shell_.rest[face][k];
    }
    return {a1, a2};
}

template <class Law>
bool MagneticSixTerm<Law>::set_values(const Values& values) {
    if (!values.changed(magnetization_, thickness_)) return false;
    linear_ = true;
    thicknesses_.assign(values[thickness_], values[thickness_] + thickness_.size());
    for (Index group = 0; group < loop_.groups(); ++group)
        for (int lane = 0; lane < SimdDouble::width; ++lane) {
            const Index f = loop_.element(group, lane);
            const Vec3 m = values.vector(magnetization_, f);
            for (int p = 0; p < points; ++p) {
                const auto [a1, a2] = rest_edges(f, p);
                const Mat3 frame = Law::rest_frame(a1, a2);
                Vec3 coordinates = frame.inverse() * m;
                // A tangential magnetization keeps a normal coordinate of round-off size after the inverse: it
                // is set to zero.
                if (std::abs(coordinates[2]) <= 1e-14 * m.norm()) coordinates[2] = 0.0;
                linear_ &= Law::is_linear(coordinates);
                typename Law::Element& e = elements_[group].at[p];
                e.volume.set(lane, 0.5 * six_nodes::inside[p].weight * a1.cross(a2).norm() * thicknesses_[f]);
                e.alpha.set(lane, coordinates[0]);
                e.beta.set(lane, coordinates[1]);
                e.gamma.set(lane, coordinates[2]);
                Law::set_rest(a1, a2, e, lane);
            }
        }
    return true;
}

template <class Law>
void MagneticSixTerm<Law>::find_points(const double* q, std::vector<Vec3>& places,
                                       std::vector<Vec3>& magnetizations) const {
    places.resize(static_cast<std::size_t>(shell_.n_faces()) * points);
    magnetizations.resize(places.size());
    loop_.each_group([&](Index group) {
        SimdVec3 x[6];
        loop_.gather(group, q, x);
        for (int p = 0; p < points; ++p) {
            const typename Law::Element& e = elements_[group].at[p];
            const SimdVec3 at = Point::position(x, p), m = Point(x, p, e).frame().magnetization(e);
            for (int lane = 0; lane < loop_.lanes_in(group); ++lane) {
                const Index n = loop_.element(group, lane) * points + p;
                places[n] = lane_of(at, lane);
                magnetizations[n] = lane_of(m, lane);
            }
        }
    });
}

template <class Law>
auto MagneticSixTerm<Law>::sample(const double* q, const LoadParameters& load_parameters, int order) const
    -> std::vector<Fields> {
    if (!field_.varies(load_parameters)) return {};
    std::vector<Vec3> places, moments;
    find_points(q, places, moments);
    return in_groups<points>(loop_, field_.sample(places, moments, order, load_parameters), order,
                             field_.uniform(load_parameters));
}

template <class Law>
void MagneticSixTerm<Law>::evaluate(const double* q, const LoadParameters& load_parameters, Residual& out) {
    const std::vector<Fields> fields = sample(q, load_parameters, 1);
    const SimdVec3 everywhere = broadcast(field_.uniform(load_parameters)), none = broadcast(Vec3::Zero());
    loop_.scatter_groups([&](Index group) {
        SimdVec3 x[6], g[6];
        loop_.gather(group, q, x);
        std::fill_n(g, 6, none);
        for (int p = 0; p < points; ++p) {
            const typename Law::Element& e = elements_[group].at[p];
            const Point at(x, p, e);
            at.add_gradient(e, fields.empty() ? everywhere : fields[group].at[p].flux, g);
            if (!fields.empty()) at.add_gradient_by_position(e, fields[group].at[p], g);
        }
        loop_.scatter(group, g, out);
    });
}

template <class Law>
void MagneticSixTerm<Law>::prepare_assembly(const double* q, const LoadParameters& load_parameters) {
    fields_ = sample(q, load_parameters, 2);
}

template <class Law>
void MagneticSixTerm<Law>::assemble(const ElementBlock& element_block, const double* q,
                                    const LoadParameters& load_parameters, bool, SystemMatrix& out) const {
    const bool varies = !fields_.empty();
    const Vec3 uniform = field_.uniform(load_parameters);
    if (!varies && (linear_ || uniform.isZero(0.0))) return;
    const SimdVec3 everywhere = broadcast(uniform);
    ElementLoop<6>::over_groups(element_block, [&](Index group) {
        SimdVec3 x[6];
        SimdMat3 h[21] = {};
        loop_.gather(group, q, x);
        for (int p = 0; p < points; ++p) {
            const typename Law::Element& e = elements_[group].at[p];
            const Point at(x, p, e);
            at.add_hessian(e, varies ? fields_[group].at[p].flux : everywhere, h);
            if (varies) at.add_hessian_by_position(e, fields_[group].at[p], h);
        }
        loop_.scatter(group, h, out);
    });
}

// The rate of the energy along lambda at each point. As for linear triangles (magnetic_term.cpp), with M' and v
// the rates of M and of x_p, and G = dB/dx,
//
//   D = - V_p (M' . B + M . G v),   M' = alpha f_1' + beta f_2' + gamma n'.
template <class Law>
void MagneticSixTerm<Law>::vjp(const double* q, const LoadParameters& load_parameters, const double* lambda,
                               Gradient& out) {
    const double factor = field_.factor(load_parameters);
    const Vec3 everywhere = field_.uniform(load_parameters);
    std::vector<Vec3> places, magnetizations;
    find_points(q, places, magnetizations);
    const FieldSamples samples = field_.at_factor_one(places, magnetizations);

    FieldProbe probe;  // - V_p (M', M, v)
    probe.flux.resize(places.size()), probe.moment.resize(places.size()),
        probe.direction.resize(places.size());
    by_magnetization_.resize(places.size());
    applied_.resize(places.size());
    loop_.each_group([&](Index group) {
        SimdVec3 x[6], along[6];
        loop_.gather(group, q, x);
        loop_.gather(group, lambda, along);
        for (int p = 0; p < points; ++p) {
            const typename Law::Element& e = elements_[group].at[p];
            const Point at(x, p, e);
            SimdVec3 columns[3], rate[3];
            at.frame().frame(columns);
            at.rates(along, rate);
            const SimdVec3 speed = Point::position(along, p);
            for (int lane = 0; lane < loop_.lanes_in(group); ++lane) {
                const Index f = loop_.element(group, lane), n = f * points + p;
                const Vec3 coordinates(e.alpha[lane], e.beta[lane], e.gamma[lane]), v = lane_of(speed, lane);
                Mat3 frame, frame_rate;
                frame << lane_of(columns[0], lane), lane_of(columns[1], lane), lane_of(columns[2], lane);
                frame_rate << lane_of(rate[0], lane), lane_of(rate[1], lane), lane_of(rate[2], lane);
                const Vec3 flux = everywhere + factor * samples.flux[n];
                const Vec3 flux_rate = factor * (samples.gradient[n] * v);
                applied_[n] = {flux, flux_rate};
                const double volume = e.volume[lane];
                const Vec3 by_coordinates =
                    -volume * (frame_rate.transpose() * flux + frame.transpose() * flux_rate);
                const auto [a1, a2] = rest_edges(f, p);
                by_magnetization_[n] = Law::rest_frame(a1, a2).transpose().inverse() * by_coordinates;
                out.values.segment<3>(magnetization_.at(f)) += by_magnetization_[n];
                out.values[thickness_.at(f)] += by_coordinates.dot(coordinates) / thicknesses_[f];
                probe.flux[n] = -volume * (frame_rate * coordinates);
                probe.moment[n] = -volume * magnetizations[n];
                probe.direction[n] = v;
            }
        }
    });
    field_.add_vjp(places, probe, samples, load_parameters, out);
}

template <class Law>
void MagneticSixTerm<Law>::add_moments(const double* q, const LoadParameters&, std::vector<Vec3>& places,
                                       std::vector<Vec3>& moments) const {
    std::vector<Vec3> at, magnetizations;
    find_points(q, at, magnetizations);
    places.insert(places.end(), at.begin(), at.end());
    const std::size_t first = moments.size();
    moments.resize(first + at.size());
    for (Index group = 0; group < loop_.groups(); ++group)
        for (int lane = 0; lane < loop_.lanes_in(group); ++lane)
            for (int p = 0; p < points; ++p) {
                const Index n = loop_.element(group, lane) * points + p;
                moments[first + n] = elements_[group].at[p].volume[lane] * magnetizations[n];
            }
}

template <class Law>
void MagneticSixTerm<Law>::add_rest_vjp(const double* q, const LoadParameters&, const double* lambda,
                                        VectorXd& out) {
    for (Index group = 0; group < loop_.groups(); ++group) {
        SimdVec3 x[6], along[6], columns[3];
        loop_.gather(group, q, x);
        loop_.gather(group, lambda, along);
        for (int p = 0; p < points; ++p) {
            const typename Law::Element& e = elements_[group].at[p];
            const Point at(x, p, e);
            const std::array<SimdVec3, 2> rates = Point::edges(along, p);
            at.frame().frame(columns);
            for (int lane = 0; lane < loop_.lanes_in(group); ++lane) {
                const Index f = loop_.element(group, lane), n = f * points + p;
                const RestPointSix rest(shell_.rest[f], six_nodes::inside[p].at);
                const RestShape shape(rest.corners());
                const Vec3 coordinates(e.alpha[lane], e.beta[lane], e.gamma[lane]);
                std::array<Vec3, 2> by_edges;
                if constexpr (std::is_same_v<Law, Magnetic>) {
                    by_edges = magnetic_by_rest_edges(shape, coordinates, by_magnetization_[n]);
                } else {
                    Mat3 frame;
                    frame << lane_of(columns[0], lane), lane_of(columns[1], lane), lane_of(columns[2], lane);
                    const Mat3 at_rest = Law::rest_frame(shape.edges[0], shape.edges[1]);
                    const MovingFace face = {{lane_of(at.frame().a1, lane), lane_of(at.frame().a2, lane)},
                                             {lane_of(rates[0], lane), lane_of(rates[1], lane)},
                                             frame * at_rest.transpose()};
                    by_edges = rotating_by_rest_edges(shape, face, at_rest * coordinates, e.volume[lane],
                                                      applied_[n]);
                }
                rest.add_by_edges(by_edges, shell_.own_nodes[f], out);
            }
        }
    }
}

template <class Law>
std::size_t MagneticSixTerm<Law>::bytes() const {
    return loop_.bytes() + bytes_of(elements_) + bytes_of(thicknesses_) + bytes_of(fields_);
}

}  // namespace

std::unique_ptr<Term> make_magnetic_six_term(MagnetizationLaw law, const SixNodeShell& shell, Index body,
                                             const ColoredLoop& element_blocks, const SystemMatrix& matrix,
                                             const FieldSources& sources, Registry& registry) {
    if (law == MagnetizationLaw::rotates)
        return std::make_unique<MagneticSixTerm<RotatingMagnetic>>(shell, body, element_blocks, matrix,
                                                                   sources, registry);
    return std::make_unique<MagneticSixTerm<Magnetic>>(shell, body, element_blocks, matrix, sources,
                                                       registry);
}

}  // namespace magshell
