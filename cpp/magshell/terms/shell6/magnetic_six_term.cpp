#include "magshell/terms/shell6/magnetic_six_term.h"

#include <Eigen/LU>
#include <optional>

#include "magshell/assembly/element_loop.h"
#include "magshell/energy/magnetic.h"
#include "magshell/energy/magnetic_rotating.h"
#include "magshell/energy/magnetic_six.h"
#include "magshell/energy/magnetic_six_fine.h"
#include "magshell/energy/rest_point_six.h"
#include "magshell/energy/rotating_rest.h"
#include "magshell/terms/element_energies.h"
#include "magshell/terms/magnetic/applied_field_term.h"
#include "magshell/terms/magnetic/element_sampling.h"
#include "magshell/terms/magnetic/total_applied_field.h"
#include "magshell/terms/rest_shape_term.h"

namespace magshell {
namespace {

// The magnetic energy of six-node faces. Each takes the field at six points of its middle surface, or finely, at those of
// face_points::fine, through its thickness too.
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
    static constexpr int points = MagneticSix<Law>::points;
    using Element = typename Law::Element;

    // The points at which a face samples the field.
    int count(Index face) const { return sampling_.count(face); }
    FacePoint point(Index face, int p) const {
        if (sampling_.is_fine(face)) return face_points::fine[p];
        const six_nodes::Point& inside = six_nodes::inside[p];
        return {inside.at, 0.0, inside.weight};
    }
    // Calls with(p, element, at) for each slot of a SIMD vector of faces with nodes at x.
    template <class With>
    void each_slot(Index group, const SimdVec3 x[6], With&& with) const {
        const Element* elements = &elements_[sampling_.first_slot(group)];
        if (!sampling_.any_fine_in(group)) {
            for (int p = 0; p < points; ++p) with(p, elements[p], MagneticSix<Law>(x, p, elements[p]));
            return;
        }
        for (int p = 0; p < sampling_.slots(group); ++p) {
            PointOverSix place;
            for (int lane = 0; lane < SimdDouble::width; ++lane) {
                const Index f = loop_.element(group, lane);
                place.set(lane, point(f, p < count(f) ? p : 0), thicknesses_[f]);
            }
            with(p, elements[p], MagneticSixFine<Law>(x, place, elements[p]));
        }
    }
    // Calls with(lane, face, n) for each point n of the faces of a SIMD vector in a slot.
    template <class With>
    void each_lane(Index group, int p, With&& with) const {
        for (int lane = 0; lane < loop_.lanes_in(group); ++lane) {
            const Index f = loop_.element(group, lane);
            if (p < count(f)) with(lane, f, sampling_.first(f) + p);
        }
    }

    // Returns the edge vectors (a~_1, a~_2) of the tangent plane at a point of a face.
    std::array<Vec3, 2> rest_edges(Index face, const std::array<double, 3>& at) const;
    // Computes the positions [m] and magnetizations [A/m] of all points, face by face.
    void find_points(const double* q, std::vector<Vec3>& places, std::vector<Vec3>& magnetizations) const;
    // Returns the applied field in every slot; empty in a uniform field. Order as in AppliedField::add_samples.
    std::vector<FieldAtPoint> sample(const double* q, const LoadParameters& load_parameters, int order) const;
    // Returns the field in a slot of a SIMD vector.
    const FieldAtPoint& field_in(const std::vector<FieldAtPoint>& fields, Index group, int p,
                                 const FieldAtPoint& everywhere) const {
        return fields.empty() ? everywhere : fields[sampling_.first_slot(group) + p];
    }
    FieldAtPoint everywhere(const LoadParameters& load_parameters) const {
        FieldAtPoint field{};
        field.flux = broadcast(field_.uniform(load_parameters));
        return field;
    }
    // Returns a function of a SIMD vector that computes the energies [J] of its faces.
    auto energy_of_group(const double* q, const LoadParameters& load_parameters) const {
        return [this, q, fields = sample(q, load_parameters, 0),
                uniform = everywhere(load_parameters)](Index group) {
            SimdVec3 x[6];
            loop_.gather(group, q, x);
            SimdDouble total(0.0);
            each_slot(group, x, [&](int p, const Element& e, const auto& at) {
                total += at.frame().energy(e, field_in(fields, group, p, uniform).flux);
            });
            return total;
        };
    }

    const SixNodeShell& shell_;
    const Index body_;
    const ElementLoop<6> loop_;
    const TotalAppliedField field_;
    ParameterSlice magnetization_, thickness_;  // values
    std::optional<ParameterSlice>
        finely_;  // value: 1 for a face that samples the field finely; only if the field can vary in space
    ElementSampling sampling_;
    std::vector<double> thicknesses_;
    std::vector<Element> elements_;  // in the slots of sampling_
    // The gradient with respect to the magnetization of each point, and the applied field there, from the last vjp().
    std::vector<Vec3> by_magnetization_;
    std::vector<FluxAndRate> applied_;
    std::vector<FieldAtPoint> fields_;  // sampled for the current assembly; empty in a uniform field
    bool linear_ = true;                // every magnetization is linear in the positions
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
      sampling_(shell.n_faces(), loop_.groups(), points, static_cast<int>(face_points::fine.size())),
      elements_(sampling_.n_slots()) {
    if (!sources.empty())
        finely_ = registry.values.add(shell.owner, "field_sampling", "1", shell.n_faces(), 1, &shell.faces);
}

template <class Law>
std::array<Vec3, 2> MagneticSixTerm<Law>::rest_edges(Index face, const std::array<double, 3>& at) const {
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
    const bool resampled = finely_ && values.changed(*finely_);
    if (!resampled && !values.changed(magnetization_, thickness_)) return false;
    if (resampled) {
        sampling_.set(loop_, values[*finely_]);
        elements_.resize(sampling_.n_slots());
    }
    linear_ = true;
    thicknesses_.assign(values[thickness_], values[thickness_] + thickness_.size());
    for (Index group = 0; group < loop_.groups(); ++group)
        for (int lane = 0; lane < SimdDouble::width; ++lane) {
            const Index f = loop_.element(group, lane);
            const Vec3 m = values.vector(magnetization_, f);
            for (int p = 0; p < sampling_.slots(group);
                 ++p) {  // slots without a point have the first one, without a volume
                const FacePoint at = point(f, p < count(f) ? p : 0);
                const auto [a1, a2] = rest_edges(f, at.at);
                const Mat3 frame = Law::rest_frame(a1, a2);
                Vec3 coordinates = frame.inverse() * m;
                // A tangential magnetization keeps a normal coordinate of round-off size after the inverse: it
                // is set to zero.
                if (std::abs(coordinates[2]) <= 1e-14 * m.norm()) coordinates[2] = 0.0;
                linear_ &= Law::is_linear(coordinates);
                Element& e = elements_[sampling_.first_slot(group) + p];
                const double weight = p < count(f) ? at.weight : 0.0;
                e.volume.set(lane, 0.5 * weight * a1.cross(a2).norm() * thicknesses_[f]);
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
    places.resize(sampling_.n_points());
    magnetizations.resize(places.size());
    loop_.each_group([&](Index group) {
        SimdVec3 x[6];
        loop_.gather(group, q, x);
        each_slot(group, x, [&](int p, const Element& e, const auto& at) {
            const SimdVec3 place = at.position(), m = at.frame().magnetization(e);
            each_lane(group, p, [&](int lane, Index, Index n) {
                places[n] = lane_of(place, lane);
                magnetizations[n] = lane_of(m, lane);
            });
        });
    });
}

template <class Law>
auto MagneticSixTerm<Law>::sample(const double* q, const LoadParameters& load_parameters, int order) const
    -> std::vector<FieldAtPoint> {
    if (!field_.varies(load_parameters)) return {};
    std::vector<Vec3> places, moments;
    find_points(q, places, moments);
    return sampling_.in_slots(loop_, field_.sample(places, moments, order, load_parameters), order,
                              field_.uniform(load_parameters));
}

template <class Law>
void MagneticSixTerm<Law>::evaluate(const double* q, const LoadParameters& load_parameters, Residual& out) {
    const std::vector<FieldAtPoint> fields = sample(q, load_parameters, 1);
    const FieldAtPoint uniform = everywhere(load_parameters);
    const SimdVec3 none = broadcast(Vec3::Zero());
    loop_.scatter_groups([&](Index group) {
        SimdVec3 x[6], g[6];
        loop_.gather(group, q, x);
        std::fill_n(g, 6, none);
        each_slot(group, x, [&](int p, const Element& e, const auto& at) {
            at.add_gradient(e, field_in(fields, group, p, uniform), !fields.empty(), g);
        });
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
    if (!varies && (linear_ || field_.uniform(load_parameters).isZero(0.0))) return;
    const FieldAtPoint uniform = everywhere(load_parameters);
    ElementLoop<6>::over_groups(element_block, [&](Index group) {
        SimdVec3 x[6];
        SimdMat3 h[21] = {};
        loop_.gather(group, q, x);
        each_slot(group, x, [&](int p, const Element& e, const auto& at) {
            at.add_hessian(e, field_in(fields_, group, p, uniform), varies, h);
        });
        loop_.scatter(group, h, out);
    });
}

// The rate of the energy along lambda at each point. As for linear triangles (magnetic_term.cpp), with M' and v
// the rates of M and of x_p, and G = dB/dx,
//
//   D = - V_p (M' . B + M . G v),   M' = alpha f_1' + beta f_2' + gamma n',
//
// and its derivative by the thickness h is D/h and, at the height z = zeta h, - V_p zeta (M' . G n + n . C v + M . G n').
template <class Law>
void MagneticSixTerm<Law>::vjp(const double* q, const LoadParameters& load_parameters, const double* lambda,
                               Gradient& out) {
    const double factor = field_.factor(load_parameters);
    const Vec3 uniform = field_.uniform(load_parameters);
    std::vector<Vec3> places, magnetizations;
    find_points(q, places, magnetizations);
    const FieldSamples samples = field_.at_factor_one(places, magnetizations, sampling_.any_fine() ? 2 : 1);

    FieldProbe probe;  // - V_p (M', M, v)
    probe.flux.resize(places.size()), probe.moment.resize(places.size()),
        probe.direction.resize(places.size());
    by_magnetization_.resize(places.size());
    applied_.resize(places.size());
    loop_.each_group([&](Index group) {
        SimdVec3 x[6], along[6];
        loop_.gather(group, q, x);
        loop_.gather(group, lambda, along);
        each_slot(group, x, [&](int p, const Element& e, const auto& at) {
            SimdVec3 columns[3], rate[3];
            at.frame().frame(columns);
            at.rates(along, rate);
            const SimdVec3 speed = at.velocity(along, rate);
            each_lane(group, p, [&](int lane, Index f, Index n) {
                const FacePoint place = point(f, p);
                const Vec3 coordinates(e.alpha[lane], e.beta[lane], e.gamma[lane]), v = lane_of(speed, lane);
                Mat3 frame, frame_rate;
                frame << lane_of(columns[0], lane), lane_of(columns[1], lane), lane_of(columns[2], lane);
                frame_rate << lane_of(rate[0], lane), lane_of(rate[1], lane), lane_of(rate[2], lane);
                const Vec3 flux = uniform + factor * samples.flux[n];
                const Vec3 flux_rate = factor * (samples.gradient[n] * v);
                applied_[n] = {flux, flux_rate};
                const double volume = e.volume[lane];
                const Vec3 by_coordinates =
                    -volume * (frame_rate.transpose() * flux + frame.transpose() * flux_rate);
                const auto [a1, a2] = rest_edges(f, place.at);
                by_magnetization_[n] = Law::rest_frame(a1, a2).transpose().inverse() * by_coordinates;
                out.values.segment<3>(magnetization_.at(f)) += by_magnetization_[n];
                out.values[thickness_.at(f)] += by_coordinates.dot(coordinates) / thicknesses_[f];
                if (place.height != 0.0)
                    out.values[thickness_.at(f)] -=
                        volume * factor * place.height *
                        ((frame_rate * coordinates).dot(samples.gradient[n] * frame.col(2)) +
                         frame.col(2).dot(samples.curvature[n] * v) +
                         magnetizations[n].dot(samples.gradient[n] * frame_rate.col(2)));
                probe.flux[n] = -volume * (frame_rate * coordinates);
                probe.moment[n] = -volume * magnetizations[n];
                probe.direction[n] = v;
            });
        });
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
            for (int p = 0; p < count(loop_.element(group, lane)); ++p) {
                const Index n = sampling_.first(loop_.element(group, lane)) + p;
                moments[first + n] =
                    elements_[sampling_.first_slot(group) + p].volume[lane] * magnetizations[n];
            }
}

template <class Law>
void MagneticSixTerm<Law>::add_rest_vjp(const double* q, const LoadParameters&, const double* lambda,
                                        VectorXd& out) {
    for (Index group = 0; group < loop_.groups(); ++group) {
        SimdVec3 x[6], along[6], columns[3];
        loop_.gather(group, q, x);
        loop_.gather(group, lambda, along);
        each_slot(group, x, [&](int p, const Element& e, const auto& at) {
            const std::array<SimdVec3, 2> rates = at.edges(along);
            at.frame().frame(columns);
            each_lane(group, p, [&](int lane, Index f, Index n) {
                const RestPointSix rest(shell_.rest[f], point(f, p).at);
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
            });
        });
    }
}

template <class Law>
std::size_t MagneticSixTerm<Law>::bytes() const {
    return loop_.bytes() + bytes_of(elements_) + bytes_of(thicknesses_) + bytes_of(fields_) +
           sampling_.bytes();
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
