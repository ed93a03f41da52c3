// Creates the terms of a scene. Their order determines the order of summation and of energies.
#include <algorithm>
#include <utility>

#include "magshell/scene/model.h"
#include "magshell/scene/scene_input.h"
#include "magshell/strain/dihedral_angle.h"
#include "magshell/strain/dihedral_angle_six.h"
#include "magshell/terms/actuator/muscle_term.h"
#include "magshell/terms/contact/body_contact_term.h"
#include "magshell/terms/contact/body_friction_term.h"
#include "magshell/terms/contact/friction_term.h"
#include "magshell/terms/joint/ball_torque_term.h"
#include "magshell/terms/joint/damper_term.h"
#include "magshell/terms/joint/joint_term.h"
#include "magshell/terms/load/edge_moment_term.h"
#include "magshell/terms/load/load_term.h"
#include "magshell/terms/load/pressure_term.h"
#include "magshell/terms/load/water_term.h"
#include "magshell/terms/magnetic/magnetic_solid_term.h"
#include "magshell/terms/magnetic/magnetic_term.h"
#include "magshell/terms/magnetic/moment_term.h"
#include "magshell/terms/shell/bending_term.h"
#include "magshell/terms/shell/membrane_term.h"
#include "magshell/terms/shell6/bending_six_term.h"
#include "magshell/terms/shell6/magnetic_six_term.h"
#include "magshell/terms/shell6/membrane_six_term.h"

namespace magshell {
namespace {

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
    double lengths[2];
    for (int g = 0; g < 2; ++g) {
        const std::array<double, 3> along = six_nodes::along(six_nodes::gauss[g]);
        const std::array<Vec3, 6>& rest = shell.rest[f];
        lengths[g] = (along[0] * rest[from] + along[1] * rest[to] + along[2] * rest[middle(i)]).norm();
    }
    const auto at_point = [&](int g) {
        return EdgeMomentTerm::EdgeMoment{nodes,
                                          g,
                                          DihedralAngleSix(x, SimdDouble(0.0), g).angle()[0],
                                          side.rotation[g],
                                          side.sign,
                                          0,
                                          lengths[g] / (lengths[0] + lengths[1])};
    };
    return {at_point(0), at_point(1)};
}

}  // namespace

void Model::add_loops(Index body, const VectorXd& curvature_scale) {
    const Shell& shell = *bodies_.shells()[body];
    const ColoredLoop& element_blocks = coloring_.of(body);
    loops_.push_back(std::make_unique<FaceLoop>(shell.corners, element_blocks, matrix_));
    membrane_faces_.push_back(std::make_unique<MembraneFaces>(shell, nodes(), curvature_scale));
    const MembraneFaces& faces = *membrane_faces_.back();
    membrane_loops_.push_back(faces.is_unchanged()
                                  ? nullptr
                                  : std::make_unique<FaceLoop>(faces.corners(), element_blocks, matrix_));
}

void Model::add_terms(const SceneInput& input) {
    const Index count = static_cast<Index>(bodies_.shells().size());
    for (Index body = 0; body < count; ++body) {
        std::unique_ptr<MembraneTerm> term =
            std::make_unique<MembraneTerm>(*bodies_.shells()[body], body, *membrane_faces_[body],
                                           membrane_loops_[body] ? *membrane_loops_[body] : *loops_[body],
                                           input.shells[body].growth, nodes(), registry_);
        elastic_.add(term.get());
        terms_.push_back(std::move(term));
    }
    for (Index body = 0; body < count; ++body) {
        std::unique_ptr<BendingTerm> term =
            std::make_unique<BendingTerm>(*bodies_.shells()[body], body, coloring_.of(body),
                                          input.shells[body].growth, nodes(), matrix_, registry_);
        elastic_.add(term.get());
        terms_.push_back(std::move(term));
    }
    for (std::size_t k = 0; k < input.six_node_shells.size(); ++k)
        add_six_node_shell(k, input.six_node_shells[k].growth);
    add_magnetic_terms(input);
    add_solids(input);
    add_muscles(input);
    for (const FaceEnergyInput& given : input.face_energies) {
        const auto& [surface, body] = bodies_.faces()[given.body];
        terms_.push_back(given.energy->term(given.owner, body, *surface, *loops_[given.body], registry_));
    }
    if (!input.pressures.empty()) {
        terms_.push_back(std::make_unique<PressureTerm>(input.pressures, nodes(), matrix_, registry_));
    }
    add_volumes(input);
    add_moments(input);
    add_joints(input);
    if (input.gravity)
        terms_.push_back(std::make_unique<LoadTerm>("gravity", "gravity_factor", nodes(), registry_));
    if (input.loads) terms_.push_back(std::make_unique<LoadTerm>("loads", "load_factor", nodes(), registry_));
    if (!input.couples.empty()) add_edge_moments(input);
    if (!input.contacts.empty()) add_contacts(input);
    if (!input.body_contacts.empty()) add_body_contacts(input);
    if (input.water) add_water(input);
}

void Model::add_water(const SceneInput& input) {
    const std::vector<Bodies::Faces>& faces = bodies_.faces();
    const std::size_t skins = input.shells.size() + input.solids.size(), after = skins + input.skins.size();
    for (std::size_t k = 0; k < faces.size(); ++k)
        if (k < skins || k >= after)
            forces_.push_back(
                std::make_unique<WaterTerm>(*faces[k].surface, *loops_[k], *input.water, registry_));
}

void Model::add_six_node_shell(std::size_t number, const GrowthForm& growth) {
    const SixNodeShell& shell = *bodies_.six_node_shells()[number];
    const Index body = bodies_.six_node_bodies()[number];
    const auto add = [&](auto term) {
        elastic_.add(term.get());
        terms_.push_back(std::move(term));
    };
    const ColoredLoop& element_blocks = coloring_.of(body);
    add(std::make_unique<MembraneSixTerm>(shell, body, element_blocks, nodes(), growth, matrix_, registry_));
    add(std::make_unique<BendingSixTerm>(shell, body, element_blocks, nodes(), growth, matrix_, registry_));
}

void Model::add_magnetic_terms(const SceneInput& input) {
    const std::size_t shells = input.shells.size(), solids = input.solids.size();
    const auto add = [&](std::size_t k) {
        const auto& [surface, body] = bodies_.faces()[k];
        terms_.push_back(std::make_unique<MagneticTerm>(*surface, body, *loops_[k], sources_, registry_));
    };
    for (std::size_t k = 0; k < shells; ++k)
        if (input.shells[k].magnetic) add(k);
    for (std::size_t k = 0; k < input.skins.size(); ++k) add(shells + solids + k);
    for (std::size_t k = 0; k < input.six_node_shells.size(); ++k) {
        const Index body = bodies_.six_node_bodies()[k];
        if (input.six_node_shells[k].magnetic)
            terms_.push_back(std::make_unique<MagneticSixTerm>(
                *bodies_.six_node_shells()[k], body, coloring_.of(body), matrix_, sources_, registry_));
    }
    for (std::size_t k = 0; k < solids; ++k) {
        const Index body = static_cast<Index>(shells + k);
        if (input.solids[k].magnetic)
            terms_.push_back(make_magnetic_solid_term(*bodies_.solids()[k], body, coloring_.of(body), matrix_,
                                                      sources_, registry_));
    }
}

void Model::add_volumes(const SceneInput& input) {
    const auto add = [&](std::unique_ptr<LowRankTerm> term) {
        borders_.push_back(term.get());
        terms_.push_back(std::move(term));
    };
    if (!input.volumes.empty()) add(std::make_unique<VolumeTerm>(input.volumes, nodes(), matrix_, registry_));
    if (!input.tendons.empty()) add(std::make_unique<TendonTerm>(input.tendons, nodes(), matrix_, registry_));
}

void Model::add_moments(const SceneInput& input) {
    std::vector<MomentTerm::Magnet> magnets;
    for (std::size_t k = 0; k < input.rigid.size(); ++k)
        if (input.rigid[k].magnetic)
            std::copy_n(bodies_.rigid_nodes()[k].begin(), 4,
                        magnets.emplace_back(MomentTerm::Magnet{input.rigid[k].owner, {}}).corners.begin());
    if (!magnets.empty())
        terms_.push_back(std::make_unique<MomentTerm>(magnets, nodes(), sources_, matrix_, registry_));
}

void Model::add_joints(const SceneInput& input) {
    const auto corners = [&](Index part) { return part < 0 ? nullptr : bodies_.rigid_nodes()[part].data(); };
    std::vector<JointTerm::Input> joints;
    std::vector<DamperTerm::Input> damped;
    std::vector<BallTorqueTerm::Input> twisted;
    for (const SkeletonInput& skeleton : input.skeletons)
        for (std::size_t k = 0; k < skeleton.links.size(); ++k) {
            if (skeleton.owners[k].empty()) continue;
            const Joint& joint = skeleton.joints[k];
            const Index *parent = corners(joint.parent < 0 ? -1 : skeleton.links[joint.parent]),
                        *child = corners(skeleton.links[k]);
            joints.push_back({skeleton.owners[k], joint, parent, child});
            if (joint.served)
                joints.push_back({skeleton.owners[k], joint, parent, child, JointTerm::Act::ball_servo});
            if (joint.coned)
                joints.push_back({skeleton.owners[k], joint, parent, child, JointTerm::Act::cone});
            if (joint.damped) damped.push_back({skeleton.owners[k], joint, parent, child});
            if (joint.twisted) twisted.push_back({skeleton.owners[k], parent, child});
        }
    for (const ClosureInput& closure : input.closures)
        joints.push_back({closure.owner, Joint{JointKind::ball, -1, closure.place, Vec3::Zero()},
                          corners(closure.parent), corners(closure.child), JointTerm::Act::closure});
    if (!joints.empty())
        terms_.push_back(std::make_unique<JointTerm>(joints, nodes().rest, matrix_, registry_));
    if (!damped.empty()) {
        std::unique_ptr<DamperTerm> term =
            std::make_unique<DamperTerm>(damped, nodes().rest, matrix_, registry_);
        damper_term_ = term.get();
        dampers_.add(term.get());
        terms_.push_back(std::move(term));
    }
    if (twisted.empty()) return;
    terms_.push_back(std::make_unique<BallTorqueTerm>(twisted, nodes().rest, registry_));
}

void Model::add_solids(const SceneInput& input) {
    for (std::size_t k = 0; k < input.solids.size(); ++k) {
        const Index body = static_cast<Index>(bodies_.shells().size() + k);
        std::unique_ptr<SolidTerm> term =
            make_solid_term(input.solids[k].response, *bodies_.solids()[k], body, coloring_.of(body), matrix_,
                            nodes(), registry_);
        elastic_.add(term.get());
        solid_terms_.push_back(term.get());
        terms_.push_back(std::move(term));
    }
}

void Model::add_muscles(const SceneInput& input) {
    for (std::size_t k = 0; k < input.muscles.size(); ++k) {
        const auto& [fibres, body] = bodies_.fibres()[k];
        Muscle muscle = make_muscle(input.muscles[k], *fibres, body, coloring_.of(body), matrix_, registry_);
        muscle_terms_.push_back(muscle.term.get());
        terms_.push_back(std::move(muscle.term));
        if (muscle.force) forces_.push_back(std::move(muscle.force));
    }
}

void Model::add_edge_moments(const SceneInput& input) {
    std::vector<EdgeMomentTerm::EdgeMoment> couples;
    const Index flat = static_cast<Index>(input.shells.size());
    Index row = 0;
    std::size_t numbered = 0;
    for (const EdgeMomentInput& given : input.couples) {
        if (given.shell < flat)
            couples.push_back(
                couple_of(given, *input.shells[given.shell].mesh, *bodies_.shells()[given.shell], nodes()));
        else
            for (const EdgeMomentTerm::EdgeMoment& couple :
                 couples_of(given, *input.six_node_shells[given.shell - flat].mesh.corners,
                            *bodies_.six_node_shells()[given.shell - flat], nodes()))
                couples.push_back(couple);
        for (; numbered < couples.size(); ++numbered) couples[numbered].row = row;
        ++row;
    }
    terms_.push_back(std::make_unique<EdgeMomentTerm>(nodes(), matrix_, std::move(couples), row, registry_));
}

void Model::add_contacts(const SceneInput& input) {
    std::unique_ptr<ContactTerm> contact =
        std::make_unique<ContactTerm>(nodes(), matrix_, input.contacts, input.obstacles, registry_);
    const ContactTerm& touched = *contact;
    contacts_.add(contact.get());
    terms_.push_back(std::move(contact));
    std::vector<bool> rubs, lagged;
    for (const ContactInput& each : input.contacts) {
        rubs.push_back(each.has_friction);
        lagged.push_back(each.lagged);
    }
    if (std::find(rubs.begin(), rubs.end(), true) != rubs.end())
        forces_.push_back(std::make_unique<FrictionTerm>(touched, std::move(rubs), std::move(lagged)));
}

void Model::add_body_contacts(const SceneInput& input) {
    layer_ = std::make_unique<ContactLayer>(matrix_.nodes(), matrix_.rotations());
    std::unique_ptr<BodyContactTerm> contact = std::make_unique<BodyContactTerm>(
        nodes(), input.contact_surfaces, input.body_contacts, *layer_, registry_);
    BodyContactTerm& touched = *contact;
    contacts_.add(contact.get());
    terms_.push_back(std::move(contact));
    std::vector<bool> rubs, lagged;
    for (const BodyContactInput& each : input.body_contacts) {
        rubs.push_back(each.has_friction);
        lagged.push_back(each.lagged);
    }
    if (std::find(rubs.begin(), rubs.end(), true) != rubs.end())
        forces_.push_back(std::make_unique<BodyFrictionTerm>(touched, std::move(rubs), std::move(lagged)));
}

}  // namespace magshell
