#include "magshell/terms/magnetic/magnetic_solid_term.h"

#include <algorithm>
#include <optional>

#include "magshell/assembly/element_loop.h"
#include "magshell/energy/magnetic.h"
#include "magshell/energy/magnetic_solid.h"
#include "magshell/energy/magnetic_solid_rotating.h"
#include "magshell/energy/rotating_rest.h"
#include "magshell/strain/fine_tetrahedron.h"
#include "magshell/strain/tetrahedron.h"
#include "magshell/terms/element_energies.h"
#include "magshell/terms/magnetic/applied_field_term.h"
#include "magshell/terms/magnetic/element_sampling.h"
#include "magshell/terms/magnetic/total_applied_field.h"
#include "magshell/terms/rest_shape_term.h"

namespace magshell {
namespace {

// The magnetic energy of the elements of a solid. Each takes the field at the integration points of its material, or finely at those of
// FineTetrahedron.
template <class Element, template <int> class Law>
class MagneticSolidTerm final : public AppliedFieldTerm, public ElementEnergies, public RestShapeTerm {
    static constexpr int N = Element::nodes, points = Element::points;
    using Nodes = std::array<Index, N>;
    using Point = Law<N>;
    using Shapes = std::array<double, N>;
    // A point in the reference configuration: the gradients g_k of its shape functions, one per row, and the volume that it represents.
    struct RestPoint {
        Eigen::Matrix<double, N, 3> gradients;
        double volume;
    };

  public:
    MagneticSolidTerm(const Solid& solid, const std::vector<Nodes>& nodes, Index body,
                      const ColoredLoop& element_blocks, const SystemMatrix& matrix,
                      const FieldSources& sources, Registry& registry)
        : solid_(solid),
          body_(body),
          loop_(nodes, element_blocks, matrix),
          field_(sources, registry),
          magnetization_(registry.values.add(solid.owner, "remanent_magnetization", "A/m", solid.n_elements(),
                                             3, &solid.elements)),
          sampling_(solid.n_elements(), loop_.groups(), points, FineTetrahedron<Element>::points),
          elements_(sampling_.n_slots()) {
        for (int p = 0; p < points; ++p) shapes_[p] = shapes_at(Element(), p);
        if (!sources.empty())
            finely_ = registry.values.add(solid.owner, "field_sampling", "1", solid.n_elements(), 1,
                                          &solid.elements);
    }

    std::string_view name() const override { return Magnetic::name; }
    Index body() const override { return body_; }

    bool set_values(const Values& values) override {
        const bool resampled = finely_ && values.changed(*finely_);
        if (!resampled && !values.changed(magnetization_)) return false;
        if (resampled) {
            sampling_.set(loop_, values[*finely_]);
            elements_.resize(sampling_.n_slots());
        }
        for (Index group = 0; group < loop_.groups(); ++group)
            for (int lane = 0; lane < SimdDouble::width; ++lane) {
                const Index t = loop_.element(group, lane), first = sampling_.first_slot(group);
                const Vec3 m = values.vector(magnetization_, t);
                each_rest_point(t, [&](int p, const RestPoint& rest) {
                    elements_[first + p].set(lane, rest.gradients, m, rest.volume);
                    if (p > 0) return;  // slots without a point have the first one, without a volume
                    for (int k = sampling_.count(t); k < sampling_.slots(group); ++k)
                        elements_[first + k].set(lane, rest.gradients, m, 0.0);
                });
            }
        return true;
    }

    double energy(const double* q, const LoadParameters& load_parameters) const override {
        return loop_.sum(energy_of_group(q, load_parameters));
    }
    std::vector<double> element_energies(const double* q,
                                         const LoadParameters& load_parameters) const override {
        return of_elements(loop_, solid_.elements.user, energy_of_group(q, load_parameters));
    }

    void evaluate(const double* q, const LoadParameters& load_parameters, Residual& out) override {
        const std::vector<FieldAtPoint> fields = sample(q, load_parameters, 1);
        const SimdVec3 everywhere = broadcast(field_.uniform(load_parameters)),
                       none = broadcast(Vec3::Zero());
        loop_.scatter_groups([&](Index group) {
            SimdVec3 x[N], g[N];
            loop_.gather(group, q, x);
            std::fill_n(g, N, none);
            const Index first = sampling_.first_slot(group);
            for (int p = 0; p < sampling_.slots(group); ++p) {
                const auto point = elements_[first + p].deformed(x);
                point.add_gradient(fields.empty() ? everywhere : fields[first + p].flux, g);
                if (!fields.empty()) point.add_gradient_by_position(shapes(group, p), fields[first + p], g);
            }
            loop_.scatter(group, g, out);
        });
    }

    void prepare_assembly(const double* q, const LoadParameters& load_parameters) override {
        fields_ = sample(q, load_parameters, 2);
    }

    void assemble(const ElementBlock& element_block, const double* q, const LoadParameters& load_parameters,
                  bool, SystemMatrix& out) const override {
        const bool varies = !fields_.empty();
        const Vec3 uniform = field_.uniform(load_parameters);
        if (!varies && (Point::is_linear || uniform.isZero(0.0))) return;
        const SimdVec3 everywhere = broadcast(uniform);
        ElementLoop<N>::over_groups(element_block, [&](Index group) {
            SimdVec3 x[N];
            SimdMat3 h[N * (N + 1) / 2];
            loop_.gather(group, q, x);
            for (SimdMat3& block : h) std::fill_n(block.at, 9, SimdDouble(0.0));
            const Index first = sampling_.first_slot(group);
            for (int p = 0; p < sampling_.slots(group); ++p) {
                const auto point = elements_[first + p].deformed(x);
                point.add_hessian(varies ? fields_[first + p].flux : everywhere, h);
                if (varies) point.add_hessian_by_position(shapes(group, p), fields_[first + p], h);
            }
            loop_.scatter(group, h, out);
        });
    }

    // The rate of the energy along lambda, with M' and v the rates of M and of x_p and G = dB/dx,
    //
    //   D = - V_p (M' . B + M . G v),   M' = F' M~ or omega x M,
    //
    // is linear in the magnetization and in the field.
    void vjp(const double* q, const LoadParameters& load_parameters, const double* lambda,
             Gradient& out) override {
        const Vec3 everywhere = field_.uniform(load_parameters);
        const double factor = field_.factor(load_parameters);
        std::vector<Vec3> places, magnetizations;
        at_points(q, places, magnetizations);
        const Rates rates = rates_at_points(q, lambda);
        const FieldSamples samples = field_.at_factor_one(places, magnetizations);
        FieldProbe probe;  // - V_p (M', M, v)
        probe.direction = rates.velocities;
        by_magnetization_.resize(places.size());
        if (!Point::is_linear) applied_.resize(places.size()), rotations_ = rates.rotations;
        for (Index t = 0; t < solid_.n_elements(); ++t) {
            const Eigen::Matrix<double, 3, N> x = nodes_of(t, q), along = nodes_of(t, lambda);
            Vec3 by_magnetization = Vec3::Zero(), before = by_magnetization;
            each_rest_point(t, [&](int p, const RestPoint& rest) {
                const Index n = sampling_.first(t) + p;
                const Vec3 flux = everywhere + factor * samples.flux[n],
                           flux_rate = factor * (samples.gradient[n] * rates.velocities[n]);
                if constexpr (Point::is_linear) {
                    by_magnetization -=
                        rest.volume *
                        (rest.gradients.transpose() * (along.transpose() * flux + x.transpose() * flux_rate));
                } else {
                    applied_[n] = {flux, flux_rate};
                    by_magnetization -= rest.volume * (rates.rotations[n].transpose() *
                                                       (flux.cross(rates.spins[n]) + flux_rate));
                }
                by_magnetization_[n] = by_magnetization - before;
                before = by_magnetization;
                probe.flux.push_back(-rest.volume * rates.magnetizations[n]);
                probe.moment.push_back(-rest.volume * magnetizations[n]);
            });
            out.values.segment<3>(magnetization_.at(t)) += by_magnetization;
        }
        field_.add_vjp(places, probe, samples, load_parameters, out);
    }

    void add_moments(const double* q, const LoadParameters&, std::vector<Vec3>& places,
                     std::vector<Vec3>& moments) const override {
        std::vector<Vec3> at, magnetizations;
        at_points(q, at, magnetizations);
        places.insert(places.end(), at.begin(), at.end());
        for (Index t = 0; t < solid_.n_elements(); ++t)
            each_rest_point(t, [&](int p, const RestPoint& rest) {
                moments.push_back(rest.volume * magnetizations[sampling_.first(t) + p]);
            });
    }

    void add_rest_vjp(const double* q, const LoadParameters&, const double* lambda, VectorXd& out) override {
        for (Index t = 0; t < solid_.n_elements(); ++t) {
            const std::span<const Index> nodes = solid_.nodes_of(t);
            const Eigen::Matrix<double, 3, N> x = nodes_of(t, q), along = nodes_of(t, lambda);
            each_rest_point(t, [&](int p, const RestPoint& rest) {
                const Eigen::Matrix<double, N, 3>& g = rest.gradients;
                Mat3 by;
                if constexpr (Point::is_linear) {
                    by = by_deformation(t, p);
                } else {
                    const SimdVec3& m = element_of_point(t, p).remanence;
                    const Index n = sampling_.first(t) + p;
                    by = rotating_by_rest_deformation(x * g, along * g, rotations_[n],
                                                      lane_of(m, t % SimdDouble::width), rest.volume,
                                                      applied_[n]);
                }
                for (int k = 0; k < N; ++k) out.segment<3>(3 * nodes[k]) += by * g.row(k).transpose();
            });
        }
    }

    std::size_t bytes() const override {
        return loop_.bytes() + bytes_of(elements_) + bytes_of(fields_) + sampling_.bytes();
    }

  private:
    // Returns a function of a SIMD vector that computes the energies [J] of its elements.
    auto energy_of_group(const double* q, const LoadParameters& load_parameters) const {
        return [this, q, fields = sample(q, load_parameters, 0),
                everywhere = broadcast(field_.uniform(load_parameters))](Index group) {
            SimdVec3 x[N];
            loop_.gather(group, q, x);
            SimdDouble total(0.0);
            const Index first = sampling_.first_slot(group);
            for (Index slot = first; slot < first + sampling_.slots(group); ++slot)
                total += elements_[slot].deformed(x).energy(fields.empty() ? everywhere : fields[slot].flux);
            return total;
        };
    }

    // Calls with(p, rest) for each point at which an element samples the field.
    template <class With>
    void each_rest_point(Index element, With&& with) const {
        Vec3 x[N];
        for (int k = 0; k < N; ++k) x[k] = solid_.rest(element, k);
        if (sampling_.is_fine(element)) {
            for (int p = 0; p < FineTetrahedron<Element>::points; ++p) {
                const auto& derivatives = fine_.derivatives[p];
                Mat3 jacobian = Mat3::Zero();  // dX/d(l_1, l_2, l_3), by columns
                for (int k = 1; k < N; ++k) jacobian += (x[k] - x[0]) * derivatives.row(k);
                with(p,
                     RestPoint{derivatives * jacobian.inverse(), fine_.weights[p] * jacobian.determinant()});
            }
            return;
        }
        const RestElement<Element> rest(x);
        for (int p = 0; p < points; ++p)
            with(p, RestPoint{Element::shape_derivatives(p) * rest.gradients[p], rest.volume[p]});
    }

    // Returns the shape functions at the points of a SIMD vector of elements.
    std::array<SimdDouble, N> shapes(Index group, int p) const {
        std::array<SimdDouble, N> all;
        if (!sampling_.any_fine_in(group)) {
            for (int k = 0; k < N; ++k) all[k] = SimdDouble(shapes_[p][k]);
            return all;
        }
        for (int lane = 0; lane < SimdDouble::width; ++lane) {
            const bool is_fine = sampling_.is_fine(loop_.element(group, lane));
            const Shapes& of = is_fine ? fine_.shapes[p] : shapes_[std::min(p, points - 1)];
            for (int k = 0; k < N; ++k) all[k].set(lane, of[k]);
        }
        return all;
    }

    const Point& element_of_point(Index t, int p) const {
        return elements_[sampling_.first_slot(t / SimdDouble::width) + p];
    }

    // Returns the derivative with respect to a homogeneous deformation I + H of the rest shape at a point of b . M~_r V_p with b V_p =
    // by_magnetization_. It turns F into F (I - H) and V_p into V_p (1 + tr H), so that b . M~_r becomes b . (I - H) M~_r.
    Mat3 by_deformation(Index t, int p) const {
        const Vec3& by = by_magnetization_[sampling_.first(t) + p];
        const auto& alpha = element_of_point(t, p).alpha;
        Vec3 magnetization = Vec3::Zero();
        for (int k = 0; k < N; ++k)
            magnetization += alpha[k][t % SimdDouble::width] * (solid_.rest(t, k) - solid_.rest(t, 0));
        return by.dot(magnetization) * Mat3::Identity() - by * magnetization.transpose();
    }

    Eigen::Matrix<double, 3, N> nodes_of(Index element, const double* from) const {
        Eigen::Matrix<double, 3, N> at;
        const std::span<const Index> nodes = solid_.nodes_of(element);
        for (int k = 0; k < N; ++k) at.col(k) = Eigen::Map<const Vec3>(from + 3 * nodes[k]);
        return at;
    }

    // Computes x_p and M at every point, element by element.
    void at_points(const double* q, std::vector<Vec3>& places, std::vector<Vec3>& magnetizations) const {
        places.resize(sampling_.n_points());
        magnetizations.resize(places.size());
        loop_.each_group([&](Index group) {
            SimdVec3 x[N];
            loop_.gather(group, q, x);
            const Index first = sampling_.first_slot(group);
            for (int p = 0; p < sampling_.slots(group); ++p) {
                const SimdVec3 place = position_of<N>(shapes(group, p), x),
                               m = elements_[first + p].deformed(x).magnetization();
                for (int lane = 0; lane < loop_.lanes_in(group); ++lane) {
                    const Index t = loop_.element(group, lane), n = sampling_.first(t) + p;
                    if (p >= sampling_.count(t)) continue;
                    places[n] = lane_of(place, lane);
                    magnetizations[n] = lane_of(m, lane);
                }
            }
        });
    }

    // Rates at all points, for given velocities of the nodes.
    struct Rates {
        std::vector<Vec3> velocities, magnetizations;
        std::vector<Mat3> rotations;  // R and the spin omega, of a magnetization that turns
        std::vector<Vec3> spins;
    };

    Rates rates_at_points(const double* q, const double* lambda) const {
        Rates rates;
        if constexpr (Point::is_linear) {
            at_points(lambda, rates.velocities, rates.magnetizations);
        } else {
            const std::size_t count = sampling_.n_points();
            rates.velocities.resize(count), rates.magnetizations.resize(count);
            rates.rotations.resize(count), rates.spins.resize(count);
            loop_.each_group([&](Index group) {
                SimdVec3 x[N], along[N];
                loop_.gather(group, q, x);
                loop_.gather(group, lambda, along);
                const Index first = sampling_.first_slot(group);
                for (int p = 0; p < sampling_.slots(group); ++p) {
                    const auto point = elements_[first + p].deformed(x);
                    const SimdVec3 velocity = position_of<N>(shapes(group, p), along),
                                   spin = point.spin(along), rate = cross(spin, point.magnetization());
                    for (int lane = 0; lane < loop_.lanes_in(group); ++lane) {
                        const Index t = loop_.element(group, lane), n = sampling_.first(t) + p;
                        if (p >= sampling_.count(t)) continue;
                        rates.velocities[n] = lane_of(velocity, lane);
                        rates.magnetizations[n] = lane_of(rate, lane);
                        rates.spins[n] = lane_of(spin, lane);
                        for (int k = 0; k < 9; ++k)
                            rates.rotations[n](k / 3, k % 3) = point.rotation().at[k][lane];
                    }
                }
            });
        }
        return rates;
    }

    // Returns the applied field in every slot; empty in a uniform field. Order as in
    // AppliedField::add_samples.
    std::vector<FieldAtPoint> sample(const double* q, const LoadParameters& load_parameters,
                                     int order) const {
        if (!field_.varies(load_parameters)) return {};
        std::vector<Vec3> places, moments;
        at_points(q, places, moments);
        return sampling_.in_slots(loop_, field_.sample(places, moments, order, load_parameters), order,
                                  field_.uniform(load_parameters));
    }

    const Solid& solid_;
    const Index body_;
    const ElementLoop<N> loop_;
    const TotalAppliedField field_;
    ParameterSlice magnetization_;
    std::optional<ParameterSlice>
        finely_;  // value: 1 for an element that samples the field finely; only if the field can vary in space
    ElementSampling sampling_;
    Shapes shapes_[points];
    const FineTetrahedron<Element>& fine_ = FineTetrahedron<Element>::get();
    std::vector<Point> elements_;  // in the slots of sampling_
    // The gradient with respect to the magnetization of each point, from the last vjp(); of one that turns also the applied field and R.
    std::vector<Vec3> by_magnetization_;
    std::vector<FluxAndRate> applied_;
    std::vector<Mat3> rotations_;
    std::vector<FieldAtPoint> fields_;  // sampled for the current assembly; empty in a uniform field
};

template <template <int> class Law>
std::unique_ptr<Term> make_term(const Solid& solid, Index body, const ColoredLoop& element_blocks,
                                const SystemMatrix& matrix, const FieldSources& sources, Registry& registry) {
    if (solid.quadratic())
        return std::make_unique<MagneticSolidTerm<QuadraticTetrahedron, Law>>(
            solid, solid.quadratic_nodes, body, element_blocks, matrix, sources, registry);
    return std::make_unique<MagneticSolidTerm<LinearTetrahedron, Law>>(
        solid, solid.linear_nodes, body, element_blocks, matrix, sources, registry);
}

}  // namespace

std::unique_ptr<Term> make_magnetic_solid_term(MagnetizationLaw law, const Solid& solid, Index body,
                                               const ColoredLoop& element_blocks, const SystemMatrix& matrix,
                                               const FieldSources& sources, Registry& registry) {
    if (law == MagnetizationLaw::rotates)
        return make_term<RotatingMagneticSolid>(solid, body, element_blocks, matrix, sources, registry);
    return make_term<MagneticSolid>(solid, body, element_blocks, matrix, sources, registry);
}

}  // namespace magshell
