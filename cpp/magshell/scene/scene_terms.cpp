#include "magshell/scene/scene_terms.h"

#include <algorithm>
#include <utility>

#include "magshell/scene/scene_input.h"
#include "magshell/strain/dihedral_angle.h"
#include "magshell/strain/dihedral_angle_six.h"
#include "magshell/terms/actuator/muscle_term.h"
#include "magshell/terms/contact/body_contact_term.h"
#include "magshell/terms/contact/body_friction_term.h"
#include "magshell/terms/contact/friction_term.h"
#include "magshell/terms/joint/damper_term.h"
#include "magshell/terms/joint/joint_term.h"
#include "magshell/terms/joint/torque_term.h"
#include "magshell/terms/load/body_force_term.h"
#include "magshell/terms/load/edge_moment_term.h"
#include "magshell/terms/load/load_term.h"
#include "magshell/terms/load/pressure_term.h"
#include "magshell/terms/load/spring_term.h"
#include "magshell/terms/load/water_term.h"
#include "magshell/terms/magnetic/induced_term.h"
#include "magshell/terms/magnetic/magnetic_solid_term.h"
#include "magshell/terms/magnetic/magnetic_term.h"
#include "magshell/terms/magnetic/moment_term.h"
#include "magshell/terms/magnetic/own_field_term.h"
#include "magshell/terms/shell/bending_term.h"
#include "magshell/terms/shell/crease_term.h"
#include "magshell/terms/shell/membrane_term.h"
#include "magshell/terms/shell6/bending_six_term.h"
#include "magshell/terms/shell6/magnetic_six_term.h"
#include "magshell/terms/shell6/membrane_six_term.h"

namespace magshell {
namespace {

// Returns the edge moment at an edge of a three-node shell, with its angle at rest to the direction node.
EdgeMomentTerm::EdgeMoment couple_of(const EdgeMomentInput& given, const TriangleMesh& mesh,
                                     const Shell& shell, const Nodes& at) {
    const bool forward = mesh.edge_faces()(given.edge, 0) != TriangleMesh::none;
    const Index f = shell.faces.core[mesh.edge_faces()(given.edge, forward ? 0 : 1)];
    int i = 0;
    while (shell.edges[f][i] != given.edge) ++i;
    const std::array<Index, 3>& c = shell.corners[f];
    const std::array<Index, 4> nodes = {c[(i + 1) % 3], c[(i + 2) % 3], c[i],
                                        at.direction_node(given.direction)};
    const DihedralAngle fold(broadcast(at.rest[nodes[0]]), broadcast(at.rest[nodes[1]]),
                             broadcast(at.rest[nodes[2]]), broadcast(at.rest[nodes[3]]), SimdDouble(0.0));
    return {{nodes[0], nodes[1], nodes[2], nodes[3], -1, -1, -1, -1, -1},
            -1,
            fold.angle()[0],
            shell.rotation_of_edge[given.edge],
            forward ? 1.0 : -1.0,
            0};
}

// Returns the edge moment at both Gauss points of an edge of a six-node shell, weighted by the length of the edge there.
std::array<EdgeMomentTerm::EdgeMoment, 2> couples_of(const EdgeMomentInput& given, const TriangleMesh& mesh,
                                                     const SixNodeShell& shell, const Nodes& at) {
    using six_nodes::middle;
    const Index user = mesh.edge_faces().row(given.edge).maxCoeff(), f = shell.faces.core[user];
    int i = 0;
    while (mesh.face_edges()(user, i) != given.edge) ++i;
    const int from = (i + 1) % 3, to = (i + 2) % 3;
    const std::array<Index, 6>& own = shell.own_nodes[f];
    const std::array<Index, 9> nodes = {own[from],
                                        own[to],
                                        own[middle(i)],
                                        own[i],
                                        own[middle(from)],
                                        own[middle(to)],
                                        at.direction_node(given.direction),
                                        -1,
                                        -1};
    SimdVec3 x[9] = {};
    for (int k = 0; k < 7; ++k) x[k] = broadcast(at.rest[nodes[k]]);
    const FaceSideSix& side = shell.sides[f][i];
    const std::array<double, 3> along[2] = {six_nodes::along(six_nodes::gauss[0]),
                                            six_nodes::along(six_nodes::gauss[1])};
    Vec3 tangents[2];
    double lengths[2];
    for (int g = 0; g < 2; ++g) {
        const std::array<Vec3, 6>& rest = shell.rest[f];
        tangents[g] = along[g][0] * rest[from] + along[g][1] * rest[to] + along[g][2] * rest[middle(i)];
        lengths[g] = tangents[g].norm();
        tangents[g] /= lengths[g];
    }
    const double length = lengths[0] + lengths[1];
    const auto at_point = [&](int g) {
        const double share = lengths[g] / length;
        std::array<Vec3, 3> by_rest;
        for (int node = 0; node < 3; ++node)
            by_rest[node] = (along[g][node] * tangents[g] -
                             share * (along[0][node] * tangents[0] + along[1][node] * tangents[1])) /
                            length;
        return EdgeMomentTerm::EdgeMoment{
            nodes, g,      DihedralAngleSix(x, SimdDouble(0.0), g).angle()[0], side.rotation[g], side.sign, 0,
            share, by_rest};
    };
    return {at_point(0), at_point(1)};
}

// Creates the terms of a scene, kind by kind.
class Builder {
  public:
    Builder(SceneTerms& out, const Bodies& bodies, const SystemMatrix& matrix, Registry& registry)
        : out_(out), bodies_(bodies), matrix_(matrix), registry_(registry) {}

    void add_loops(Index body, const VectorXd& curvature_scale);
    void add_terms(const SceneInput& input);

  private:
    void add_body_contacts(const SceneInput& input);
    void add_contacts(const SceneInput& input);
    /// Adds the friction of a contact term, if any of its contacts has friction.
    template <class Friction, class Inputs, class Contact>
    void add_friction(const Inputs& inputs, Contact& contact);
    void add_edge_moments(const SceneInput& input);
    void add_joints(const SceneInput& input);
    void add_wrenches(const SceneInput& input);
    void add_magnetic_terms(const SceneInput& input);
    void add_moments(const SceneInput& input);
    void add_muscles(const SceneInput& input);
    void add_own_field(const SceneInput& input);
    void add_six_node_shell(std::size_t number, const GrowthForm& growth);
    void add_solids(const SceneInput& input);
    void add_springs(const SceneInput& input);
    void add_volumes(const SceneInput& input);
    void add_water(const SceneInput& input);

    SceneTerms& out_;
    const Bodies& bodies_;
    const SystemMatrix& matrix_;
    Registry& registry_;
};

void Builder::add_loops(Index body, const VectorXd& curvature_scale) {
    const Shell& shell = *bodies_.shells()[body];
    const ColoredLoop& element_blocks = out_.coloring.of(body);
    out_.loops.push_back(std::make_unique<FaceLoop>(shell.corners, element_blocks, matrix_));
    out_.membrane_faces.push_back(std::make_unique<MembraneFaces>(shell, bodies_.nodes(), curvature_scale));
    const MembraneFaces& faces = *out_.membrane_faces.back();
    out_.membrane_loops.push_back(faces.is_unchanged()
                                      ? nullptr
                                      : std::make_unique<FaceLoop>(faces.corners(), element_blocks, matrix_));
}

void Builder::add_terms(const SceneInput& input) {
    const Index count = static_cast<Index>(bodies_.shells().size());
    for (Index body = 0; body < count; ++body) {
        std::unique_ptr<MembraneTerm> term = std::make_unique<MembraneTerm>(
            *bodies_.shells()[body], body, *out_.membrane_faces[body],
            out_.membrane_loops[body] ? *out_.membrane_loops[body] : *out_.loops[body],
            input.shells[body].growth, bodies_.nodes(), registry_);
        out_.elastic.add(term.get());
        out_.energies.push_back(std::move(term));
    }
    for (Index body = 0; body < count; ++body) {
        std::unique_ptr<BendingTerm> term =
            std::make_unique<BendingTerm>(*bodies_.shells()[body], body, out_.coloring.of(body),
                                          input.shells[body].growth, bodies_.nodes(), matrix_, registry_);
        out_.elastic.add(term.get());
        out_.energies.push_back(std::move(term));
    }
    for (std::size_t k = 0; k < input.six_node_shells.size(); ++k)
        add_six_node_shell(k, input.six_node_shells[k].growth);
    add_magnetic_terms(input);
    if (input.own_field.acts()) add_own_field(input);
    add_solids(input);
    add_muscles(input);
    for (const FaceEnergyInput& given : input.face_energies) {
        const auto& [surface, body] = bodies_.faces()[given.body];
        out_.energies.push_back(
            given.energy->term(given.owner, body, *surface, *out_.loops[given.body], registry_));
    }
    if (!input.pressures.empty()) {
        out_.energies.push_back(
            std::make_unique<PressureTerm>(input.pressures, bodies_.nodes(), matrix_, registry_));
    }
    for (const GroupEnergyInput& given : input.group_energies)
        out_.energies.push_back(
            std::make_unique<GroupEnergyTerm>(given, bodies_.nodes(), matrix_, registry_));
    if (!input.springs.empty()) add_springs(input);
    if (!input.creases.empty())
        out_.energies.push_back(
            std::make_unique<CreaseTerm>(input.creases, bodies_.nodes(), matrix_, registry_));
    add_volumes(input);
    add_moments(input);
    add_joints(input);
    add_wrenches(input);
    if (input.gravity)
        out_.energies.push_back(
            std::make_unique<LoadTerm>("gravity", "gravity_factor", bodies_.nodes(), registry_));
    if (input.loads)
        out_.energies.push_back(
            std::make_unique<LoadTerm>("loads", "load_factor", bodies_.nodes(), registry_));
    if (!input.couples.empty()) add_edge_moments(input);
    if (!input.contacts.empty()) add_contacts(input);
    if (!input.body_contacts.empty()) add_body_contacts(input);
    if (input.water) add_water(input);
}

void Builder::add_water(const SceneInput& input) {
    const std::vector<Bodies::Faces>& faces = bodies_.faces();
    const std::size_t skins = input.shells.size() + input.solids.size(), after = skins + input.skins.size();
    for (std::size_t k = 0; k < faces.size(); ++k)
        if (k < skins || k >= after)
            out_.forces.push_back(
                std::make_unique<WaterTerm>(*faces[k].surface, *out_.loops[k], *input.water, registry_));
}

void Builder::add_six_node_shell(std::size_t number, const GrowthForm& growth) {
    const SixNodeShell& shell = *bodies_.six_node_shells()[number];
    const Index body = bodies_.six_node_bodies()[number];
    const auto add = [&](auto term) {
        out_.elastic.add(term.get());
        out_.energies.push_back(std::move(term));
    };
    const ColoredLoop& element_blocks = out_.coloring.of(body);
    add(std::make_unique<MembraneSixTerm>(shell, body, element_blocks, bodies_.nodes(), growth, matrix_,
                                          registry_));
    add(std::make_unique<BendingSixTerm>(shell, body, element_blocks, bodies_.nodes(), growth, matrix_,
                                         registry_));
}

void Builder::add_magnetic_terms(const SceneInput& input) {
    const std::size_t shells = input.shells.size(), solids = input.solids.size();
    const auto add = [&](std::size_t k, MagnetizationLaw law) {
        const auto& [surface, body] = bodies_.faces()[k];
        out_.energies.push_back(
            make_magnetic_term(law, *surface, body, *out_.loops[k], out_.field_sources, registry_));
    };
    for (std::size_t k = 0; k < shells; ++k)
        if (input.shells[k].magnetic) add(k, input.shells[k].magnetization_law);
    for (std::size_t k = 0; k < shells; ++k) {
        const auto& [surface, body] = bodies_.faces()[k];
        if (input.shells[k].susceptible)
            out_.energies.push_back(
                make_induced_term(*surface, body, *out_.loops[k], out_.field_sources, registry_));
    }
    for (std::size_t k = 0; k < input.skins.size(); ++k)
        add(shells + solids + k, input.skins[k].magnetization_law);
    for (std::size_t k = 0; k < input.six_node_shells.size(); ++k) {
        const Index body = bodies_.six_node_bodies()[k];
        const SixNodeShellInput& given = input.six_node_shells[k];
        if (given.magnetic)
            out_.energies.push_back(
                make_magnetic_six_term(given.magnetization_law, *bodies_.six_node_shells()[k], body,
                                       out_.coloring.of(body), matrix_, out_.field_sources, registry_));
    }
    for (std::size_t k = 0; k < solids; ++k) {
        const Index body = static_cast<Index>(shells + k);
        if (input.solids[k].magnetic)
            out_.energies.push_back(
                make_magnetic_solid_term(input.solids[k].magnetization_law, *bodies_.solids()[k], body,
                                         out_.coloring.of(body), matrix_, out_.field_sources, registry_));
    }
}

void Builder::add_own_field(const SceneInput& input) {
    const OwnFieldInput& given = input.own_field;
    OwnFieldTerm::Sources sources;
    for (const Index shell : given.shells)
        sources.sheets.emplace_back(*bodies_.faces()[shell].surface, input.shells[shell].magnetization_law);
    for (const Index shell : given.six_node_shells)
        sources.sheets.emplace_back(*bodies_.six_node_shells()[shell],
                                    input.six_node_shells[shell].magnetization_law);
    for (const Index skin : given.skins)
        sources.sheets.emplace_back(
            *bodies_.faces()[input.shells.size() + input.solids.size() + skin].surface,
            input.skins[skin].magnetization_law);
    for (const Index solid : given.solids)
        sources.solids.push_back({bodies_.solids()[solid], input.solids[solid].magnetization_law});
    for (const Index part : given.rigid)
        sources.magnets.push_back({input.rigid[part].owner, bodies_.rigid_nodes()[part]});
    std::unique_ptr<OwnFieldTerm> term = std::make_unique<OwnFieldTerm>(
        std::move(sources), given.max_points, given.accuracy, bodies_.nodes(), registry_);
    out_.own_field = term.get();
    out_.operators.push_back(term.get());
    out_.energies.push_back(std::move(term));
}

void Builder::add_springs(const SceneInput& input) {
    std::unique_ptr<SpringTerm> term =
        std::make_unique<SpringTerm>(input.springs, bodies_.nodes(), matrix_, registry_);
    if (term->capabilities().has_own_viscosity) {
        out_.damped.push_back(term.get());
        out_.dampers.add(term.get());
    }
    out_.energies.push_back(std::move(term));
}

void Builder::add_volumes(const SceneInput& input) {
    const auto add = [&](std::unique_ptr<LowRankTerm> term) {
        out_.low_rank.push_back(term.get());
        out_.energies.push_back(std::move(term));
    };
    if (!input.volumes.empty())
        add(std::make_unique<VolumeTerm>(input.volumes, bodies_.nodes(), matrix_, registry_));
    if (!input.tendons.empty())
        add(std::make_unique<TendonTerm>(input.tendons, bodies_.nodes(), matrix_, registry_));
}

void Builder::add_moments(const SceneInput& input) {
    std::vector<MomentTerm::Magnet> magnets;
    for (std::size_t k = 0; k < input.rigid.size(); ++k)
        if (input.rigid[k].magnetic)
            std::copy_n(bodies_.rigid_nodes()[k].begin(), 4,
                        magnets.emplace_back(MomentTerm::Magnet{input.rigid[k].owner, {}}).corners.begin());
    if (!magnets.empty())
        out_.energies.push_back(
            std::make_unique<MomentTerm>(magnets, bodies_.nodes(), out_.field_sources, matrix_, registry_));
}

void Builder::add_joints(const SceneInput& input) {
    const auto corners = [&](Index part) { return part < 0 ? nullptr : bodies_.rigid_nodes()[part].data(); };
    std::vector<JointTerm::Input> joints;
    std::vector<DamperTerm::Input> damped;
    std::vector<TorqueTerm::Input> loaded;
    for (const SkeletonInput& skeleton : input.skeletons)
        for (std::size_t k = 0; k < skeleton.links.size(); ++k) {
            if (skeleton.owners[k].empty()) continue;
            const Joint& joint = skeleton.joints[k];
            const Index *parent = corners(joint.parent < 0 ? -1 : skeleton.links[joint.parent]),
                        *child = corners(skeleton.links[k]);
            joints.push_back({skeleton.owners[k], joint, parent, child});
            if (joint.has_servo)
                joints.push_back({skeleton.owners[k], joint, parent, child, JointTerm::Act::ball_servo});
            if (joint.has_cone)
                joints.push_back({skeleton.owners[k], joint, parent, child, JointTerm::Act::cone});
            if (joint.has_damper) damped.push_back({skeleton.owners[k], joint, parent, child});
            if (joint.has_torque) loaded.push_back({skeleton.owners[k], parent, child});
        }
    for (const ClosureInput& closure : input.closures)
        joints.push_back({closure.owner, Joint{.origin = closure.place}, corners(closure.parent),
                          corners(closure.child), JointTerm::Act::closure});
    if (!joints.empty())
        out_.energies.push_back(
            std::make_unique<JointTerm>(joints, bodies_.nodes().rest, matrix_, registry_));
    if (!damped.empty()) {
        std::unique_ptr<DamperTerm> term =
            std::make_unique<DamperTerm>(damped, bodies_.nodes().rest, matrix_, registry_);
        out_.damped.push_back(term.get());
        out_.dampers.add(term.get());
        out_.energies.push_back(std::move(term));
    }
    if (loaded.empty()) return;
    out_.energies.push_back(std::make_unique<TorqueTerm>("joints", loaded, bodies_.nodes().rest, registry_));
}

void Builder::add_wrenches(const SceneInput& input) {
    std::vector<BodyForceTerm::Input> forced;
    std::vector<TorqueTerm::Input> loaded;
    for (std::size_t k = 0; k < input.rigid.size(); ++k) {
        const RigidInput& body = input.rigid[k];
        const Index* corners = bodies_.rigid_nodes()[k].data();
        if (body.has_force) forced.push_back({body.owner, corners});
        if (body.has_torque) loaded.push_back({body.owner, nullptr, corners});
    }
    if (!forced.empty())
        out_.energies.push_back(std::make_unique<BodyForceTerm>(forced, bodies_.nodes().rest, registry_));
    if (!loaded.empty())
        out_.energies.push_back(
            std::make_unique<TorqueTerm>("wrenches", loaded, bodies_.nodes().rest, registry_));
}

void Builder::add_solids(const SceneInput& input) {
    for (std::size_t k = 0; k < input.solids.size(); ++k) {
        const Index body = static_cast<Index>(bodies_.shells().size() + k);
        std::unique_ptr<SolidTerm> term =
            make_solid_term(input.solids[k].response, *bodies_.solids()[k], body, out_.coloring.of(body),
                            matrix_, bodies_.nodes(), registry_);
        out_.elastic.add(term.get());
        out_.solids.push_back(term.get());
        out_.energies.push_back(std::move(term));
    }
}

void Builder::add_muscles(const SceneInput& input) {
    for (std::size_t k = 0; k < input.muscles.size(); ++k) {
        const auto& [fibres, body] = bodies_.fibres()[k];
        Muscle muscle =
            make_muscle(input.muscles[k], *fibres, body, out_.coloring.of(body), matrix_, registry_);
        out_.muscles.push_back(muscle.term.get());
        out_.energies.push_back(std::move(muscle.term));
        if (muscle.force) out_.forces.push_back(std::move(muscle.force));
    }
}

void Builder::add_edge_moments(const SceneInput& input) {
    std::vector<EdgeMomentTerm::EdgeMoment> couples;
    const Index flat = static_cast<Index>(input.shells.size());
    Index row = 0;
    std::size_t numbered = 0;
    for (const EdgeMomentInput& given : input.couples) {
        if (given.shell < flat)
            couples.push_back(couple_of(given, *input.shells[given.shell].mesh,
                                        *bodies_.shells()[given.shell], bodies_.nodes()));
        else
            for (const EdgeMomentTerm::EdgeMoment& couple :
                 couples_of(given, *input.six_node_shells[given.shell - flat].mesh.corners,
                            *bodies_.six_node_shells()[given.shell - flat], bodies_.nodes()))
                couples.push_back(couple);
        for (; numbered < couples.size(); ++numbered) couples[numbered].row = row;
        ++row;
    }
    out_.energies.push_back(
        std::make_unique<EdgeMomentTerm>(bodies_.nodes(), matrix_, std::move(couples), row, registry_));
}

template <class Friction, class Inputs, class Contact>
void Builder::add_friction(const Inputs& inputs, Contact& contact) {
    std::vector<bool> has_friction, lagged;
    for (const auto& each : inputs) {
        has_friction.push_back(each.has_friction);
        lagged.push_back(each.lagged);
    }
    if (std::find(has_friction.begin(), has_friction.end(), true) == has_friction.end()) return;
    out_.forces.push_back(std::make_unique<Friction>(
        contact,
        FrictionContacts<typename Contact::ActiveContact>(std::move(has_friction), std::move(lagged))));
    out_.contacts.add(out_.forces.back().get());
}

void Builder::add_contacts(const SceneInput& input) {
    std::unique_ptr<ContactTerm> contact =
        std::make_unique<ContactTerm>(bodies_.nodes(), matrix_, input.contacts, input.obstacles,
                                      bodies_.corners_of(input.attached_to), registry_);
    const ContactTerm& touched = *contact;
    out_.contacts.add(contact.get());
    out_.energies.push_back(std::move(contact));
    add_friction<FrictionTerm>(input.contacts, touched);
}

void Builder::add_body_contacts(const SceneInput& input) {
    out_.contact_layer = std::make_unique<ContactLayer>(matrix_.nodes(), matrix_.rotations());
    std::unique_ptr<BodyContactTerm> contact = std::make_unique<BodyContactTerm>(
        bodies_.nodes(), input.contact_surfaces, input.body_contacts, *out_.contact_layer, registry_);
    BodyContactTerm& touched = *contact;
    out_.contacts.add(contact.get());
    out_.energies.push_back(std::move(contact));
    add_friction<BodyFrictionTerm>(input.body_contacts, touched);
}

}  // namespace

SceneTerms::SceneTerms(const SceneInput& input, const Bodies& bodies, const SystemMatrix& matrix,
                       Registry& registry)
    : coloring(bodies.nodes().n_nodes(), bodies.all()),
      field_sources(input.field_sources, registry),
      of_body(bodies.all().size()) {
    // These load parameters exist in every scene, whether a term reads them or not.
    registry.load_parameters.add("scene", "applied_flux_density", "T", 1, 3);
    for (const char* factor : {"field_factor", "load_factor", "gravity_factor"})
        registry.load_parameters.add("scene", factor, "1", 1, 1);
    Builder builder(*this, bodies, matrix, registry);
    for (Index body = 0; body < static_cast<Index>(bodies.shells().size()); ++body)
        builder.add_loops(body, input.shells[body].curvature_scale);
    for (std::size_t k = bodies.shells().size(); k < bodies.faces().size(); ++k) {
        const auto& [surface, body] = bodies.faces()[k];
        loops.push_back(surface ? std::make_unique<FaceLoop>(surface->corners, coloring.of(body), matrix)
                                : nullptr);
    }
    builder.add_terms(input);
    for (const std::unique_ptr<Term>& term : energies) {
        const Capabilities own = term->capabilities();
        capabilities |= own;
        if (own.has_infeasible_states) restricting.push_back(term.get());
        if (term->body() >= 0) of_body[term->body()].push_back(term.get());
    }
    capabilities.has_velocity_forces = !forces.empty();
}

SceneTerms::~SceneTerms() = default;

const ElasticTerm& SceneTerms::elastic_term(Index shell, std::string_view name) const {
    const std::vector<ElasticTerm*>& all = elastic.all();
    const auto found = std::find_if(all.begin(), all.end(), [&](const ElasticTerm* term) {
        return term->body() == shell && term->name() == name;
    });
    return **found;
}

std::size_t SceneTerms::bytes() const {
    std::size_t total = coloring.bytes();
    for (const std::unique_ptr<FaceLoop>& loop : loops) total += loop ? loop->bytes() : 0;
    for (std::size_t k = 0; k < membrane_faces.size(); ++k)
        total += membrane_faces[k]->bytes() + (membrane_loops[k] ? membrane_loops[k]->bytes() : 0);
    for (const std::unique_ptr<Term>& term : energies) total += term->bytes();
    return total;
}

}  // namespace magshell
