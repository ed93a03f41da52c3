// Contact of surfaces, looked at pair by pair: scenes take it whole.
#include <string>

#include "bindings/arrays.h"
#include "magshell/contact/pair_energy.h"
#include "magshell/core/errors.h"

namespace magshell::bindings {
namespace {

PairKind kind_of(const std::string& name) {
    if (name == "point_triangle") return PairKind::point_triangle;
    if (name == "edge_edge") return PairKind::edge_edge;
    if (name == "point_edge") return PairKind::point_edge;
    if (name == "point_point") return PairKind::point_point;
    throw InvalidInput("kind must be 'point_triangle', 'edge_edge', 'point_edge' or 'point_point', got '" +
                       name + "'");
}

/// Vectors of the nodes of n pairs: (n, 4, 3).
class PairRows {
  public:
    PairRows(const Array& array, const char* name) : array_(array) {
        if (array.ndim() != 3 || array.shape(1) != 4 || array.shape(2) != 3)
            throw InvalidInput(std::string(name) + " must have shape (n, 4, 3)");
    }
    py::ssize_t count() const { return array_.shape(0); }
    PairPlaces operator[](py::ssize_t pair) const {
        const double* p = array_.data(pair, 0, 0);
        return {Vec3(p), Vec3(p + 3), Vec3(p + 6), Vec3(p + 9)};
    }

  private:
    Array array_;
};

void copy_rows(const PairVectors& from, double* to) {
    for (const Vec3& each : from) to = std::copy_n(each.data(), 3, to);
}

// (distances (n,), weights (n, 4), normals (n, 3), how many places are free (n,))
py::tuple proximities(const std::string& kind, const Array& places) {
    const PairKind which = kind_of(kind);
    const PairRows x(places, "places [m]");
    Array distances(x.count()), weights({x.count(), py::ssize_t{4}}), normals({x.count(), py::ssize_t{3}});
    IndexArray free(x.count());
    for (py::ssize_t k = 0; k < x.count(); ++k) {
        const Proximity near = proximity(which, x[k]);
        distances.mutable_at(k) = near.distance;
        std::copy_n(near.weights.data(), 4, weights.mutable_data(k, 0));
        std::copy_n(near.normal.data(), 3, normals.mutable_data(k, 0));
        free.mutable_at(k) = near.free;
    }
    return py::make_tuple(distances, weights, normals, free);
}

struct Pairs {
    ContactPair pair;
    BarrierLaw law;
};

Pairs pairs_of(const std::string& kind, double area, double parallel, const py::dict& law) {
    Pairs pairs;
    pairs.pair.kind = kind_of(kind);
    pairs.pair.area = area;
    pairs.pair.parallel = parallel;
    pairs.law = {law["stiffness"].cast<double>(), law["reach"].cast<double>(),
                 law["thickness"].cast<double>(), law["smoothing"].cast<double>(),
                 law["penalty"].cast<bool>()};
    return pairs;
}

// energy (n,), gradient (n, 4, 3), Hessian (n, 12, 12), normal force (n,) and its derivative by places (n, 4, 3).
py::dict energies(const std::string& kind, const Array& places, double area, double parallel,
                  const py::dict& law, bool cautious) {
    const Pairs with = pairs_of(kind, area, parallel, law);
    const PairRows x(places, "places [m]");
    const py::ssize_t n = x.count();
    Array energy(n), force(n), gradient({n, py::ssize_t{4}, py::ssize_t{3}}),
        by_place({n, py::ssize_t{4}, py::ssize_t{3}}), hessian({n, py::ssize_t{12}, py::ssize_t{12}});
    for (py::ssize_t k = 0; k < n; ++k) {
        const PairEnergy at(with.pair, x[k], with.law);
        Eigen::Map<Eigen::Matrix<double, 12, 12, Eigen::RowMajor>> full(hessian.mutable_data(k, 0, 0));
        full.setZero();
        PairVectors zero;
        zero.fill(Vec3::Zero());
        energy.mutable_at(k) = at.acts() ? at.energy() : 0.0;
        force.mutable_at(k) = at.acts() ? at.normal_force() : 0.0;
        copy_rows(at.acts() ? at.gradient() : zero, gradient.mutable_data(k, 0, 0));
        copy_rows(at.acts() ? at.normal_force_by_place() : zero, by_place.mutable_data(k, 0, 0));
        if (!at.acts()) continue;
        PairBlocks blocks;
        at.hessian(cautious, blocks);
        for (int i = 0, b = 0; i < nodes_of(with.pair.kind); ++i)
            for (int j = 0; j <= i; ++j, ++b) {
                full.block<3, 3>(3 * i, 3 * j) = blocks[b];
                full.block<3, 3>(3 * j, 3 * i) = blocks[b].transpose();
            }
    }
    return py::dict(py::arg("energy") = energy, py::arg("gradient") = gradient, py::arg("hessian") = hessian,
                    py::arg("normal_force") = force, py::arg("normal_force_by_place") = by_place);
}

// The derivatives of lambda . gradient + by_normal_force . normal force by stiffness, reach, thickness, smoothing: (n, 4).
Array by_law(const std::string& kind, const Array& places, double area, double parallel, const py::dict& law,
             const Array& lambda, const Array& by_normal_force) {
    const Pairs with = pairs_of(kind, area, parallel, law);
    const PairRows x(places, "places [m]"), along(lambda, "lambda");
    if (along.count() != x.count() || by_normal_force.size() != x.count())
        throw InvalidInput("lambda and by_normal_force must be as many as places");
    Array out({x.count(), py::ssize_t{4}});
    for (py::ssize_t k = 0; k < x.count(); ++k) {
        const PairEnergy at(with.pair, x[k], with.law);
        PairEnergy::ByLaw by;
        if (at.acts()) by = at.vjp(along[k], by_normal_force.data()[k]);
        const double numbers[4] = {by.stiffness, by.reach, by.thickness, by.smoothing};
        std::copy_n(numbers, 4, out.mutable_data(k, 0));
    }
    return out;
}

}  // namespace

void register_contact(py::module_& module) {
    module.def("pair_proximities", &proximities, py::arg("kind"), py::arg("places"),
               "(distances (n,), weights (n, 4), normals (n, 3), free places (n,)) of pairs with nodes at "
               "(n, 4, 3) [m].");
    module.def(
        "pair_energies", &energies, py::arg("kind"), py::arg("places"), py::arg("area"), py::arg("parallel"),
        py::arg("law"), py::arg("cautious") = false,
        "energy (n,), gradient (n, 4, 3), hessian (n, 12, 12), normal_force (n,) and normal_force_by_place "
        "(n, 4, 3) of pairs with nodes at (n, 4, 3) [m].");
    module.def(
        "pair_energies_by_law", &by_law, py::arg("kind"), py::arg("places"), py::arg("area"),
        py::arg("parallel"), py::arg("law"), py::arg("lambda_"), py::arg("by_normal_force"),
        "Derivatives of lambda . gradient + by_normal_force * normal_force by stiffness, reach, thickness, "
        "smoothing: (n, 4).");
}

}  // namespace magshell::bindings
