// Binds the contact of surfaces pair by pair. Scenes evaluate whole terms instead.
#include <limits>
#include <string>

#include "bindings/arrays.h"
#include "bindings/bindings.h"
#include "magshell/contact/broad_phase.h"
#include "magshell/contact/continuous.h"
#include "magshell/contact/pair_friction.h"
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

/// The vectors of the nodes of n pairs: (n, 4, 3).
class PairRows {
  public:
    PairRows(const Array& array, const char* name) : array_(array) {
        if (array.ndim() != 3 || array.shape(1) != 4 || array.shape(2) != 3)
            throw InvalidInput(std::string(name) + " must have shape (n, 4, 3)");
    }
    py::ssize_t count() const { return array_.shape(0); }
    PairPositions operator[](py::ssize_t pair) const {
        const double* p = array_.data(pair, 0, 0);
        return {Vec3(p), Vec3(p + 3), Vec3(p + 6), Vec3(p + 9)};
    }

  private:
    Array array_;
};

// Returns the vectors of the nodes of n slip maps: (n, 5, 3).
std::vector<SlipVectors> slip_rows(const Array& array, const char* name) {
    if (array.ndim() != 3 || array.shape(1) != slip_nodes || array.shape(2) != 3)
        throw InvalidInput(std::string(name) + " must have shape (n, 5, 3)");
    std::vector<SlipVectors> rows(static_cast<std::size_t>(array.shape(0)));
    for (py::ssize_t k = 0; k < array.shape(0); ++k)
        for (int i = 0; i < slip_nodes; ++i) rows[k][i] = Vec3(array.data(k, i, 0));
    return rows;
}

void copy_rows(const PairVectors& from, double* to) {
    for (const Vec3& each : from) to = std::copy_n(each.data(), 3, to);
}

// Returns (distances (n,), weights (n, 4), normals (n, 3), numbers of free parameters (n,)).
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

Pairs pairs_of(const std::string& kind, double area, double parallel, const py::dict& law,
               double room = std::numeric_limits<double>::infinity()) {
    Pairs pairs;
    pairs.pair.kind = kind_of(kind);
    pairs.pair.area = area;
    pairs.pair.parallel = parallel;
    pairs.pair.room = room;
    pairs.law = {law["stiffness"].cast<double>(), law["activation_distance"].cast<double>(),
                 law["min_distance"].cast<double>(), law["smoothing"].cast<double>(),
                 law["penalty"].cast<bool>()};
    return pairs;
}

// Returns energy (n,), gradient (n, 4, 3), Hessian (n, 12, 12), normal force (n,) and its derivative by
// positions (n, 4, 3).
py::dict pair_energies_of(const std::string& kind, const Array& places, double area, double parallel,
                          const py::dict& law, bool positive_definite, double room) {
    const Pairs with = pairs_of(kind, area, parallel, law, room);
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
        copy_rows(at.acts() ? at.normal_force_by_position() : zero, by_place.mutable_data(k, 0, 0));
        if (!at.acts()) continue;
        PairBlocks blocks;
        at.hessian(positive_definite, blocks);
        for (int i = 0, b = 0; i < nodes_of(with.pair.kind); ++i)
            for (int j = 0; j <= i; ++j, ++b) {
                full.block<3, 3>(3 * i, 3 * j) = blocks[b];
                full.block<3, 3>(3 * j, 3 * i) = blocks[b].transpose();
            }
    }
    return py::dict(py::arg("energy") = energy, py::arg("gradient") = gradient, py::arg("hessian") = hessian,
                    py::arg("normal_force") = force, py::arg("normal_force_by_place") = by_place);
}

// Returns the sums over pairs of their gradients (4, 3) and of the lower blocks of their Hessians (10, 3, 3),
// to measure their time.
py::tuple sums(const std::string& kind, const Array& places, double area, double parallel,
               const py::dict& law, bool positive_definite) {
    const Pairs with = pairs_of(kind, area, parallel, law);
    const PairRows x(places, "places [m]");
    Array gradient({py::ssize_t{4}, py::ssize_t{3}}),
        hessian({py::ssize_t{10}, py::ssize_t{3}, py::ssize_t{3}});
    PairVectors slope;
    PairBlocks sum;
    slope.fill(Vec3::Zero());
    sum.fill(Mat3::Zero());
    const int count = nodes_of(with.pair.kind);
    for (py::ssize_t k = 0; k < x.count(); ++k) {
        const PairEnergy at(with.pair, x[k], with.law);
        if (!at.acts()) continue;
        const PairVectors by = at.gradient();
        PairBlocks blocks;
        at.hessian(positive_definite, blocks);
        for (int i = 0; i < count; ++i) slope[i] += by[i];
        for (int b = 0; b < count * (count + 1) / 2; ++b) sum[b] += blocks[b];
    }
    copy_rows(slope, gradient.mutable_data());
    for (int b = 0; b < 10; ++b)
        for (int r = 0; r < 3; ++r)
            for (int c = 0; c < 3; ++c) hessian.mutable_at(b, r, c) = sum[b](r, c);
    return py::make_tuple(gradient, hessian);
}

// Returns the derivatives of lambda . gradient + by_normal_force . normal force by stiffness, activation
// distance, minimum separation and smoothing: (n, 4).
Array by_law(const std::string& kind, const Array& places, double area, double parallel, const py::dict& law,
             const Array& lambda, const Array& by_normal_force, double room) {
    const Pairs with = pairs_of(kind, area, parallel, law, room);
    const PairRows x(places, "places [m]"), along(lambda, "lambda");
    if (along.count() != x.count() || by_normal_force.size() != x.count())
        throw InvalidInput("lambda and by_normal_force must be as many as places");
    Array out({x.count(), py::ssize_t{4}});
    for (py::ssize_t k = 0; k < x.count(); ++k) {
        const PairEnergy at(with.pair, x[k], with.law);
        PairEnergy::ByLaw by;
        if (at.acts()) by = at.vjp(along[k], by_normal_force.data()[k]);
        const double numbers[4] = {by.stiffness, by.activation_distance, by.min_distance, by.smoothing};
        std::copy_n(numbers, 4, out.mutable_data(k, 0));
    }
    return out;
}

// Returns the collision-free fractions of straight paths: (n,).
Array free_shares(const std::string& kind, const Array& from, const Array& to, double thickness,
                  double keep) {
    const PairKind which = kind_of(kind);
    const PairRows begin(from, "from [m]"), end(to, "to [m]");
    if (begin.count() != end.count()) throw InvalidInput("there must be as many ways' ends as beginnings");
    Array shares(begin.count());
    for (py::ssize_t k = 0; k < begin.count(); ++k)
        shares.mutable_at(k) = collision_free_step(which, begin[k], end[k], thickness, keep);
    return shares;
}

// Returns force (n, 5, 3); by_velocity, secant, by_place (n, 15, 15); slip (n, 3); and the derivatives of lambda . force by
// velocities and positions (n, 5, 3), normal forces (n,) and (kinetic, fixed, sticking speed) (n, 3). The nodes are those of the pair, and then
// further corners of the triangle of its second part: `places`, velocities and lambda are (n, 5, 3), zero where a pair has fewer.
py::dict frictions(const std::string& kind, const Array& places, double area, double parallel,
                   const py::dict& law, const Array& velocities, const std::array<double, 3>& friction,
                   const Array& lambda) {
    const Pairs with = pairs_of(kind, area, parallel, law);
    const std::vector<SlipVectors> x = slip_rows(places, "places [m]"),
                                   v = slip_rows(velocities, "velocities [m/s]"),
                                   along = slip_rows(lambda, "lambda");
    const py::ssize_t n = static_cast<py::ssize_t>(x.size());
    if (v.size() != x.size() || along.size() != x.size())
        throw InvalidInput("velocities and lambda must be as many as places");
    constexpr py::ssize_t nodes = slip_nodes;
    const auto vectors = [&] { return Array({n, nodes, py::ssize_t{3}}); };
    const auto squares = [&] { return Array({n, 3 * nodes, 3 * nodes}); };
    Array force = vectors(), by_velocity = squares(), secant = squares(), by_place = squares(),
          along_velocity = vectors(), along_place = vectors(), along_normal_force(n),
          along_law({n, py::ssize_t{3}}), slip({n, py::ssize_t{3}});
    using Square = Eigen::Map<Eigen::Matrix<double, 3 * slip_nodes, 3 * slip_nodes, Eigen::RowMajor>>;
    const auto copy_slip_rows = [](const SlipVectors& from, double* to) {
        for (const Vec3& each : from) to = std::copy_n(each.data(), 3, to);
    };
    for (py::ssize_t k = 0; k < n; ++k) {
        PairPositions of_pair;
        std::copy_n(x[k].begin(), 4, of_pair.begin());
        const PairEnergy at(with.pair, of_pair, with.law);
        if (!at.acts()) throw InvalidInput("every pair must act");
        SlipStencil stencil;
        stencil.positions = x[k];
        stencil.count = with.pair.kind == PairKind::edge_edge ? 5 : 4;
        stencil.corner = with.pair.kind == PairKind::edge_edge ? 2 : 1;
        const PairFriction rub(at, stencil, v[k], {friction[0], friction[1], friction[2]});
        copy_slip_rows(rub.force(), force.mutable_data(k, 0, 0));
        std::copy_n(rub.slip().data(), 3, slip.mutable_data(k, 0));
        Square full(by_velocity.mutable_data(k, 0, 0)), held(secant.mutable_data(k, 0, 0)),
            placed(by_place.mutable_data(k, 0, 0));
        PairFriction::Blocks blocks;
        rub.by_position(blocks);
        for (int i = 0; i < slip_nodes; ++i)
            for (int j = 0; j < slip_nodes; ++j) {
                full.block<3, 3>(3 * i, 3 * j) = rub.by_velocity(i, j, false);
                held.block<3, 3>(3 * i, 3 * j) = rub.by_velocity(i, j, true);
                placed.block<3, 3>(3 * i, 3 * j) = blocks[slip_nodes * i + j];
            }
        const PairFriction::Gradient by = rub.vjp(along[k]);
        copy_slip_rows(by.by_velocity, along_velocity.mutable_data(k, 0, 0));
        copy_slip_rows(by.by_position, along_place.mutable_data(k, 0, 0));
        along_normal_force.mutable_at(k) = by.by_normal_force;
        const double numbers[3] = {by.by_law.kinetic, by.by_law.fixed, by.by_law.sticking_speed};
        std::copy_n(numbers, 3, along_law.mutable_data(k, 0));
    }
    return py::dict(py::arg("force") = force, py::arg("slip") = slip, py::arg("by_velocity") = by_velocity,
                    py::arg("secant") = secant, py::arg("by_place") = by_place,
                    py::arg("along_velocity") = along_velocity, py::arg("along_place") = along_place,
                    py::arg("along_normal_force") = along_normal_force, py::arg("along_law") = along_law);
}

// Returns the pairs of the broad phase as columns: contact (n,), kind (n,), nodes (n, 4), area, parallel, room
// (n,), faces (n, 2), swapped (n,).
py::dict columns_of(const std::vector<NearPair>& pairs) {
    const auto n = static_cast<py::ssize_t>(pairs.size());
    IndexArray contact(n), kind(n), nodes({n, py::ssize_t{4}}), faces({n, py::ssize_t{2}}), swapped(n);
    Array area(n), parallel(n), room(n);
    for (py::ssize_t k = 0; k < n; ++k) {
        const NearPair& near = pairs[k];
        contact.mutable_at(k) = near.contact;
        kind.mutable_at(k) = static_cast<int>(near.pair.kind);
        std::copy_n(near.pair.nodes.data(), 4, nodes.mutable_data(k, 0));
        faces.mutable_at(k, 0) = near.first_face;
        faces.mutable_at(k, 1) = near.second_face;
        swapped.mutable_at(k) = near.swapped;
        area.mutable_at(k) = near.pair.area;
        parallel.mutable_at(k) = near.pair.parallel;
        room.mutable_at(k) = near.pair.room;
    }
    return py::dict(py::arg("contact") = contact, py::arg("kind") = kind, py::arg("nodes") = nodes,
                    py::arg("area") = area, py::arg("parallel") = parallel, py::arg("room") = room,
                    py::arg("faces") = faces, py::arg("swapped") = swapped);
}

std::vector<Vec3> vectors_of(const Array& rows) {
    const Rows3 all = to_rows3(rows);
    std::vector<Vec3> vectors;
    for (Eigen::Index k = 0; k < all.rows(); ++k) vectors.push_back(all.row(k).transpose());
    return vectors;
}

BroadPhase make_broad_phase(const Array& rest, const std::vector<std::vector<std::array<Index, 3>>>& surfaces,
                            const std::vector<std::array<Index, 2>>& contacts) {
    const std::vector<Vec3> at_rest = vectors_of(rest);
    std::vector<ContactSurface> all;
    for (const auto& faces : surfaces) all.emplace_back(faces, at_rest);
    std::vector<SurfacePair> pairs;
    for (const auto& [a, b] : contacts) pairs.push_back({a, b});
    return BroadPhase(std::move(all), std::move(pairs));
}

template <class Find>
py::dict unlocked(const Find& find) {
    std::vector<NearPair> pairs;
    {
        const py::gil_scoped_release released;
        pairs = find();
    }
    return columns_of(pairs);
}

}  // namespace

void register_contact_pairs(py::module_& module) {
    module.def("pair_proximities", &proximities, py::arg("kind"), py::arg("places"),
               "(distances (n,), weights (n, 4), normals (n, 3), free places (n,)) of pairs with nodes at "
               "(n, 4, 3) [m].");
    module.def(
        "pair_energies", &pair_energies_of, py::arg("kind"), py::arg("places"), py::arg("area"),
        py::arg("parallel"), py::arg("law"), py::arg("cautious") = false,
        py::arg("room") = std::numeric_limits<double>::infinity(),
        "energy (n,), gradient (n, 4, 3), hessian (n, 12, 12), normal_force (n,) and normal_force_by_place "
        "(n, 4, 3) of pairs with nodes at (n, 4, 3) [m].");
    module.def("pair_energies_by_law", &by_law, py::arg("kind"), py::arg("places"), py::arg("area"),
               py::arg("parallel"), py::arg("law"), py::arg("lambda_"), py::arg("by_normal_force"),
               py::arg("room") = std::numeric_limits<double>::infinity(),
               "Derivatives of lambda . gradient + by_normal_force * normal_force by stiffness, "
               "activation_distance, min_distance, "
               "smoothing: (n, 4).");
    module.def(
        "pair_sums", &sums, py::arg("kind"), py::arg("places"), py::arg("area"), py::arg("parallel"),
        py::arg("law"), py::arg("cautious") = false,
        "Sums over pairs of their gradients (4, 3) and of the lower blocks of their Hessians (10, 3, 3).");
    module.def("pair_free_shares", &free_shares, py::arg("kind"), py::arg("from_"), py::arg("to"),
               py::arg("thickness"), py::arg("keep"),
               "Shares (n,) of the ways of pairs from (n, 4, 3) to (n, 4, 3) [m] on which they keep that "
               "share of what "
               "their distance is above the thickness.");
    module.def("pair_frictions", &frictions, py::arg("kind"), py::arg("places"), py::arg("area"),
               py::arg("parallel"), py::arg("law"), py::arg("velocities"), py::arg("friction"),
               py::arg("lambda_"),
               "force (n, 5, 3) and slip (n, 3) of pairs that act, with friction = (kinetic, fixed, sticking "
               "speed), its "
               "derivatives, and "
               "those of lambda . force.");
    py::class_<BroadPhase>(module, "BroadPhase")
        .def(py::init(&make_broad_phase), py::arg("rest_positions"), py::arg("surfaces"), py::arg("contacts"))
        .def(
            "make_room",
            [](BroadPhase& self, const Array& rest, const std::vector<double>& near_at_rest) {
                self.make_room(vectors_of(rest), near_at_rest);
            },
            py::arg("rest_positions"), py::arg("near_at_rest"))
        .def(
            "near",
            [](BroadPhase& self, const Array& positions, const std::vector<double>& margins) {
                return unlocked([&] { return self.near(positions.data(), margins); });
            },
            py::arg("positions"), py::arg("margins"),
            "Columns of the pairs that are nearer than the margins [m].")
        .def(
            "near_on_the_way",
            [](BroadPhase& self, const Array& positions, const Array& end,
               const std::vector<double>& margins) {
                return unlocked([&] { return self.near_along_path(positions.data(), end.data(), margins); });
            },
            py::arg("positions"), py::arg("end"), py::arg("margins"))
        .def(
            "crossings",
            [](BroadPhase& self, const Array& positions) {
                return unlocked([&] { return self.crossings(positions.data()); });
            },
            py::arg("positions"));
}

}  // namespace magshell::bindings
