#include <algorithm>
#include <map>

#include "bindings/arrays.h"
#include "bindings/scene_input.h"
#include "magshell/scene/model.h"

namespace magshell::bindings {
namespace {

// Returns (F, Cauchy stress, volumes) at the integration points: (n_t, p, 3, 3) twice and (n_t, p).
py::tuple point_states(const Model& model, Index solid, const VectorXd& q) {
    PointStates states;
    {
        const py::gil_scoped_release unlocked;
        states = model.terms().solids[solid]->point_states(q.data());
    }
    const Index elements = model.bodies().solids()[solid]->n_elements();
    py::array_t<double> volumes(
        {static_cast<py::ssize_t>(elements), static_cast<py::ssize_t>(states.points)});
    std::copy(states.volumes.begin(), states.volumes.end(), volumes.mutable_data());
    return py::make_tuple(to_matrices(states.deformation_gradients, elements, states.points),
                          to_matrices(states.cauchy_stresses, elements, states.points), volumes);
}

}  // namespace

MagnetizationLaw magnetization_law_of(const py::handle& given) {
    return given["magnetization_rotates"].cast<bool>() ? MagnetizationLaw::rotates
                                                       : MagnetizationLaw::stretches;
}

SolidSurface surface_of(const py::handle& given) {
    return {given["surface"].cast<std::shared_ptr<TriangleMesh>>(),
            given["surface_vertices"].cast<std::vector<Index>>()};
}

std::vector<SolidInput> solids_of(const py::list& given) {
    std::vector<SolidInput> solids;
    for (const py::handle each : given) {
        SolidInput& solid = solids.emplace_back();
        solid.owner = each["owner"].cast<std::string>();
        solid.rest_positions = to_rows3(each["rest_positions"].cast<Array>());
        const IndexArray elements = each["elements"].cast<IndexArray>();
        solid.elements.assign(elements.data(), elements.data() + elements.size());
        solid.nodes_per_element = static_cast<int>(elements.shape(1));
        solid.vertices = each["vertices"].cast<std::vector<Index>>();
        solid.surface = surface_of(each);
        solid.magnetic = each["magnetic"].cast<bool>();
        solid.magnetization_law = magnetization_law_of(each);
        solid.surface_acts = each["surface_acts"].cast<bool>();
        solid.response = {each["material"].cast<std::string>(), each["mean_volume"].cast<bool>()};
    }
    return solids;
}

std::vector<SkinInput> skins_of(const py::list& given) {
    std::vector<SkinInput> skins;
    for (const py::handle each : given)
        skins.push_back({each["owner"].cast<std::string>(), surface_of(each), magnetization_law_of(each)});
    return skins;
}

void register_solid(py::module_& module) {
    module.def(
        "solid_point_states", &point_states, py::arg("model"), py::arg("solid"), py::arg("q"),
        "(F, Cauchy stress [Pa], rest volumes [m3]) at the points of integration of a solid's elements: "
        "(n_t, p, 3, 3) twice and (n_t, p).");
}

std::vector<VolumeInput> volumes_of(const py::list& given) {
    const std::map<std::string, VolumeLaw> laws = {{"pressure", VolumeLaw::pressure},
                                                   {"gas", VolumeLaw::gas},
                                                   {"liquid", VolumeLaw::liquid},
                                                   {"cell", VolumeLaw::cell}};
    std::vector<VolumeInput> volumes;
    for (const py::handle each : given) {
        VolumeInput& volume = volumes.emplace_back();
        volume.owner = each["owner"].cast<std::string>();
        volume.law = laws.at(each["law"].cast<std::string>());
        volume.stays_open = each["stays_open"].cast<bool>();
        volume.coupled = each["coupled"].cast<bool>();
        for (const py::handle surface : each["surfaces"])
            volume.surfaces.push_back({surface["triangles"].cast<std::vector<Index>>(),
                                       surface["curved"].cast<std::vector<Index>>(),
                                       surface["weights"].cast<std::vector<double>>(),
                                       surface["curved_weights"].cast<std::vector<double>>()});
    }
    return volumes;
}

std::vector<TendonInput> tendons_of(const py::list& given) {
    std::vector<TendonInput> tendons;
    for (const py::handle each : given) {
        TendonInput& tendon = tendons.emplace_back();
        tendon.owner = each["owner"].cast<std::string>();
        tendon.slides = each["slides"].cast<bool>();
        tendon.shares = each["shares"].cast<std::vector<double>>();
        for (const py::handle point : each["points"])
            tendon.points.push_back(
                {point["vertices"].cast<std::vector<Index>>(), point["weights"].cast<std::vector<double>>()});
    }
    return tendons;
}

std::vector<SpringsInput> springs_of(const py::list& given) {
    std::vector<SpringsInput> all;
    for (const py::handle each : given) {
        SpringsInput& springs = all.emplace_back();
        springs.owner = each["owner"].cast<std::string>();
        springs.stiffness_rows = each["stiffness_rows"].cast<Index>();
        springs.rest_length_rows = each["rest_length_rows"].cast<Index>();
        springs.damping_rows = each["damping_rows"].cast<Index>();
        springs.ground_rows = each["ground_rows"].cast<Index>();
        springs.has_places = each["has_places"].cast<bool>();
        springs.stiffness_unit = each["stiffness_unit"].cast<std::string>();
        springs.damping_unit = each["damping_unit"].cast<std::string>();
        const Rows3 directions = to_rows3(each["directions"].cast<Array>()),
                    grounds = to_rows3(each["grounds"].cast<Array>());
        const std::vector<Index> numbers = each["numbers"].cast<std::vector<Index>>();
        const std::vector<double> shares = each["shares"].cast<std::vector<double>>();
        std::size_t k = 0;
        for (const py::handle point : each["points"]) {
            springs.springs.push_back({point["vertices"].cast<std::vector<Index>>(),
                                       point["weights"].cast<std::vector<double>>(),
                                       directions.row(static_cast<Index>(k)).transpose(), shares[k],
                                       numbers[k], grounds.row(static_cast<Index>(k)).transpose()});
            ++k;
        }
    }
    return all;
}

std::vector<CreaseInput> creases_of(const py::list& given) {
    std::vector<CreaseInput> all;
    for (const py::handle each : given)
        all.push_back({each["owner"].cast<std::string>(),
                       each["edges"].cast<std::vector<std::array<Index, 4>>>(),
                       each["stiffness_rows"].cast<Index>(), each["angle_rows"].cast<Index>()});
    return all;
}

}  // namespace magshell::bindings
