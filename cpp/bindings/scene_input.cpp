#include "bindings/scene_input.h"

#include <string>
#include <tuple>
#include <utility>

#include "bindings/arrays.h"

namespace magshell::bindings {
namespace {

std::vector<DirectedEdge> directed_edges(const IndexArray& pairs) {
    std::vector<DirectedEdge> edges;
    for (py::ssize_t k = 0; k < pairs.shape(0); ++k) edges.push_back({pairs.at(k, 0), pairs.at(k, 1)});
    return edges;
}

std::vector<PrescribedNode> held_nodes(const IndexArray& nodes, const Array& frames) {
    std::vector<PrescribedNode> held;
    for (py::ssize_t k = 0; k < nodes.shape(0); ++k) {
        Mat3 frame;
        for (int r = 0; r < 3; ++r)
            for (int c = 0; c < 3; ++c) frame(r, c) = frames.at(k, r, c);
        held.push_back(
            {nodes.at(k, 0), nodes.at(k, 1), frame, {nodes.at(k, 2), nodes.at(k, 3), nodes.at(k, 4)}});
    }
    return held;
}

std::vector<TiedDof> tied_of(const py::list& given) {
    std::vector<TiedDof> tied;
    for (const py::handle each : given) {
        TiedDof& dof = tied.emplace_back();
        dof.dof = each["dof"].cast<Index>();
        for (const auto& [part, weight] : each["parts"].cast<std::vector<std::pair<Index, double>>>())
            dof.parts.push_back({part, weight});
        for (const auto& [move, axis, weight] :
             each["moves"].cast<std::vector<std::tuple<Index, int, double>>>())
            dof.moves.push_back({move, axis, weight});
    }
    return tied;
}

Vec3 to_vec3(const py::handle& given) {
    const Array numbers = given.cast<Array>();
    return {numbers.at(0), numbers.at(1), numbers.at(2)};
}

std::vector<RoundInput> rounds_of(const py::handle& given) {
    std::vector<RoundInput> rounds;
    for (const py::handle each : given)
        rounds.push_back(
            {each["shape"].cast<Index>(), each["obstacle"].cast<Index>(), each["core"].cast<ShapeCore>()});
    return rounds;
}

std::vector<ContactInput> contacts_of(const py::list& given) {
    std::vector<ContactInput> contacts;
    for (const py::handle each : given) {
        ContactInput& contact = contacts.emplace_back();
        contact.obstacles = each["obstacles"].cast<std::vector<Index>>();
        contact.has_friction = each["rubs"].cast<bool>();
        contact.lagged = each["lagged"].cast<bool>();
        contact.rounds = rounds_of(each["rounds"]);
        const IndexArray vertices = each["vertices"].cast<IndexArray>();
        const Array weights = each["weights"].cast<Array>();
        for (py::ssize_t p = 0; p < vertices.shape(0); ++p)
            contact.points.push_back(
                {{vertices.at(p, 0), vertices.at(p, 1), vertices.at(p, 2)}, Vec3(weights.data(p, 0))});
    }
    return contacts;
}

std::vector<ContactSurfaceInput> contact_surfaces_of(const py::list& given) {
    std::vector<ContactSurfaceInput> surfaces;
    for (const py::handle each : given) {
        ContactSurfaceInput& surface = surfaces.emplace_back();
        surface.name = each["name"].cast<std::string>();
        surface.numbers = each["numbers"].cast<std::vector<Index>>();
        const IndexArray faces = each["faces"].cast<IndexArray>();
        for (py::ssize_t f = 0; f < faces.shape(0); ++f)
            surface.faces.push_back({faces.at(f, 0), faces.at(f, 1), faces.at(f, 2)});
    }
    return surfaces;
}

std::vector<BodyContactInput> body_contacts_of(const py::list& given) {
    std::vector<BodyContactInput> contacts;
    for (const py::handle each : given)
        contacts.push_back({each["a"].cast<Index>(), each["b"].cast<Index>(), each["penalty"].cast<bool>(),
                            each["rubs"].cast<bool>(), each["lagged"].cast<bool>()});
    return contacts;
}

GrowthForm growth_of(const py::handle& sheet) {
    const auto form = [&](const char* name) {
        const auto [rows, width] = sheet[name].cast<std::pair<Index, Index>>();
        return TensorForm{rows, width};
    };
    return {form("growth"), form("rest_curvature")};
}

std::vector<ShellInput> sheets_of(const py::list& given) {
    std::vector<ShellInput> sheets;
    for (const py::handle each : given) {
        ShellInput& sheet = sheets.emplace_back();
        sheet.owner = each["owner"].cast<std::string>();
        sheet.mesh = each["mesh"].cast<std::shared_ptr<TriangleMesh>>();
        sheet.vertices = each["vertices"].cast<std::vector<Index>>();
        sheet.curvature_scale = to_vector(each["curvature_scale"].cast<Array>());
        sheet.growth = growth_of(each);
        sheet.directors = each["directors"].cast<bool>();
        sheet.magnetic = each["magnetic"].cast<bool>();
        sheet.magnetization_law = magnetization_law_of(each);
        sheet.susceptible = each["susceptible"].cast<bool>();
        sheet.directed_edges = directed_edges(each["directed_edges"].cast<IndexArray>());
    }
    return sheets;
}

std::vector<SixNodeShellInput> six_node_sheets_of(const py::list& given) {
    std::vector<SixNodeShellInput> sheets;
    for (const py::handle each : given) {
        SixNodeShellInput& sheet = sheets.emplace_back();
        sheet.owner = each["owner"].cast<std::string>();
        sheet.mesh.rest_positions = to_rows3(each["rest_positions"].cast<Array>());
        const IndexArray faces = each["faces"].cast<IndexArray>();
        for (py::ssize_t f = 0; f < faces.shape(0); ++f)
            for (std::array<Index, 6>& nodes = sheet.mesh.faces.emplace_back();
                 const int k : {0, 1, 2, 3, 4, 5})
                nodes[k] = faces.at(f, k);
        sheet.growth = growth_of(each);
        sheet.mesh.corners = each["corners"].cast<std::shared_ptr<TriangleMesh>>();
        sheet.mesh.vertices = each["vertices"].cast<std::vector<Index>>();
        sheet.directed_edges = directed_edges(each["directed_edges"].cast<IndexArray>());
        sheet.surface = surface_of(each);
        sheet.magnetic = each["magnetic"].cast<bool>();
        sheet.magnetization_law = magnetization_law_of(each);
        sheet.surface_acts = each["surface_acts"].cast<bool>();
    }
    return sheets;
}

std::vector<PressureInput> pressures_of(const py::list& given) {
    std::vector<PressureInput> pressures;
    for (const py::handle each : given)
        pressures.push_back({each["owner"].cast<std::string>(), each["rows"].cast<Index>(),
                             each["nodes_per_face"].cast<int>(), each["nodes"].cast<std::vector<Index>>(),
                             each["row"].cast<std::vector<Index>>()});
    return pressures;
}

std::vector<RigidInput> rigid_of(const py::list& given) {
    std::vector<RigidInput> rigid;
    for (const py::handle each : given)
        rigid.push_back({each["owner"].cast<std::string>(), to_rows3(each["points"].cast<Array>()),
                         each["vertices"].cast<std::vector<Index>>(), each["magnetic"].cast<bool>(),
                         each["has_force"].cast<bool>(), each["has_torque"].cast<bool>()});
    return rigid;
}

std::vector<SkeletonInput> skeletons_of(const py::list& given) {
    std::vector<SkeletonInput> skeletons;
    for (const py::handle each : given) {
        SkeletonInput& skeleton = skeletons.emplace_back();
        skeleton.links = each["links"].cast<std::vector<Index>>();
        skeleton.owners = each["owners"].cast<std::vector<std::string>>();
        skeleton.labels = each["labels"].cast<std::vector<std::string>>();
        for (const py::handle joint : each["joints"])
            skeleton.joints.push_back({&JointKind::of(joint["kind"].cast<std::string>()),
                                       joint["parent"].cast<Index>(), to_vec3(joint["origin"]),
                                       to_vec3(joint["axis"]), joint["numbers"].cast<std::vector<double>>(),
                                       joint["driven"].cast<bool>(), joint["damped"].cast<bool>(),
                                       joint["twisted"].cast<bool>(), joint["served"].cast<bool>(),
                                       joint["coned"].cast<bool>()});
    }
    return skeletons;
}

std::vector<ClosureInput> closures_of(const py::list& given) {
    std::vector<ClosureInput> closures;
    for (const py::handle each : given)
        closures.push_back({each["owner"].cast<std::string>(), each["parent"].cast<Index>(),
                            each["child"].cast<Index>(), to_vec3(each["place"])});
    return closures;
}

}  // namespace

SceneInput scene_input(const py::kwargs& given) {
    const auto array = [&](const char* name) { return given[name].cast<Array>(); };
    const auto indices = [&](const char* name) { return given[name].cast<IndexArray>(); };
    SceneInput input;
    input.n_vertices = given["n_vertices"].cast<Index>();
    input.original = given["original"].cast<std::vector<Index>>();
    input.shells = sheets_of(given["sheets"]);
    input.six_node_shells = six_node_sheets_of(given["six_node_sheets"]);
    input.solids = solids_of(given["solids"]);
    input.skins = skins_of(given["skins"]);
    input.muscles = muscles_of(given["muscles"]);
    input.rigid = rigid_of(given["rigid"]);
    input.skeletons = skeletons_of(given["skeletons"]);
    input.closures = closures_of(given["closures"]);
    input.directions = to_rows3(array("directions"));
    input.held = held_nodes(indices("held_nodes"), array("held_frames"));
    input.tied = tied_of(given["tied"]);
    input.moves = given["moves"].cast<Index>();
    const IndexArray couples = indices("couples");
    for (py::ssize_t k = 0; k < couples.shape(0); ++k)
        input.couples.push_back({couples.at(k, 0), couples.at(k, 1), couples.at(k, 2)});
    for (const py::handle each : given["face_energies"])
        input.face_energies.push_back({each["owner"].cast<std::string>(), each["body"].cast<Index>(),
                                       each["energy"].cast<std::shared_ptr<FaceEnergy>>()});
    input.pressures = pressures_of(given["pressures"]);
    input.volumes = volumes_of(given["volumes"]);
    input.tendons = tendons_of(given["tendons"]);
    input.springs = springs_of(given["springs"]);
    input.creases = creases_of(given["creases"]);
    input.group_energies = group_energies_of(given["group_energies"]);
    input.gravity = given["gravity"].cast<bool>();
    input.loads = given["loads"].cast<bool>();
    for (const py::handle source : given["field_sources"])
        input.field_sources.push_back(source.cast<std::shared_ptr<AppliedField>>());
    input.contacts = contacts_of(given["contacts"]);
    input.contact_surfaces = contact_surfaces_of(given["contact_surfaces"]);
    input.body_contacts = body_contacts_of(given["body_contacts"]);
    for (const py::handle obstacle : given["obstacles"])
        input.obstacles.push_back(obstacle.cast<std::shared_ptr<Obstacle>>());
    input.attached_to = given["attached_to"].cast<std::vector<Index>>();
    input.water = given["water"].cast<std::shared_ptr<Water>>();
    input.own_field = {given["own_field_shells"].cast<std::vector<Index>>(),
                       given["own_field_six_node_shells"].cast<std::vector<Index>>(),
                       given["own_field_solids"].cast<std::vector<Index>>(),
                       given["own_field_skins"].cast<std::vector<Index>>(),
                       given["own_field_rigid"].cast<std::vector<Index>>(),
                       given["own_field_max_points"].cast<Index>(),
                       given["own_field_accuracy"].cast<double>()};
    return input;
}

}  // namespace magshell::bindings
