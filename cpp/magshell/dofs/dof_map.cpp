#include "magshell/dofs/dof_map.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <set>
#include <string>
#include <utility>

#include "magshell/core/errors.h"
#include "magshell/dofs/linear_ties.h"
#include "magshell/dofs/reduced_assembly.h"

namespace magshell {
namespace {

// The frames of rotated nodes, and those of all others, which are the world axes.
struct Frames {
    const std::vector<Index>& frame_of;
    const std::vector<PrescribedNode>& prescribed;

    // Returns a vector of all dofs with the components of rotated nodes along their frames; out_of() does the reverse.
    VectorXd into(const VectorXd& full) const {
        VectorXd local = full;
        for (Index node = 0; node < static_cast<Index>(frame_of.size()); ++node)
            if (frame_of[node] >= 0)
                local.segment<3>(3 * node) =
                    prescribed[frame_of[node]].frame.transpose() * full.segment<3>(3 * node);
        return local;
    }
    void out_of(VectorXd& local) const {
        for (Index node = 0; node < static_cast<Index>(frame_of.size()); ++node)
            if (frame_of[node] >= 0) {
                const Vec3 own = local.segment<3>(3 * node);
                local.segment<3>(3 * node) = prescribed[frame_of[node]].frame * own;
            }
    }
    // Returns the direction of a dof: an axis of the frame of its node, or of the world.
    Vec3 direction(Index dof) const {
        const Index node = dof / 3;
        const bool rotated = !frame_of.empty() && frame_of[node] >= 0;
        return rotated ? Vec3(prescribed[frame_of[node]].frame.col(dof % 3)) : Vec3(Vec3::Unit(dof % 3));
    }
};

const LinearTies* ties_of(const std::unique_ptr<ReducedAssembly>& reduced) {
    return reduced ? reduced->ties() : nullptr;
}

}  // namespace

DofMap::DofMap(const SystemMatrix& matrix, std::vector<PrescribedNode> prescribed, const Nodes& nodes,
               Index moves, Registry& registry, ReducedCoordinatesList reduced)
    : prescribed_(std::move(prescribed)), nodes_(nodes), moves_(moves), full_size_(matrix.size()) {
    support_factor_ = registry.load_parameters.add("scene", "support_factor", "1", 1, 1);
    for (Index k = 0; k < moves; ++k) {
        const std::string owner = "move " + std::to_string(k);
        slices_.push_back({registry.values.add(owner, "center", "m", 1, 3),
                           registry.values.add(owner, "rotation", "rad", 1, 3),
                           registry.values.add(owner, "displacement", "m", 1, 3)});
    }
    std::vector<char> is_prescribed(matrix.size(), 0);
    prescribed_at_.assign(matrix.nodes(), -1);
    for (Index k = 0; k < static_cast<Index>(prescribed_.size()); ++k) {
        const PrescribedNode& h = prescribed_[k];
        prescribed_at_[h.node] = k;
        if (h.n_prescribed == 3 || axis_aligned(h)) {
            for (int axis = 0; axis < h.n_prescribed; ++axis) {
                Index component;
                h.frame.col(axis).cwiseAbs().maxCoeff(&component);
                is_prescribed[3 * h.node + (h.n_prescribed == 3 ? axis : component)] = 1;
            }
            continue;
        }
        if (frame_of_.empty()) frame_of_.assign(matrix.nodes(), -1);
        frame_of_[h.node] = k;
        for (int axis = 0; axis < h.n_prescribed; ++axis) is_prescribed[3 * h.node + axis] = 1;
    }

    if (!reduced.empty()) reduced_ = std::make_unique<ReducedAssembly>(std::move(reduced), matrix);
    if (const LinearTies* ties = ties_of(reduced_))
        for (const TiedDof& each : ties->tied())
            if (is_prescribed[each.dof]) throw InvalidInput("a dof is tied that a support holds");
    for (Index u = 0; u < matrix.size(); ++u)
        if (!is_prescribed[u] && !(reduced_ && reduced_->is_reduced(u))) free_dofs_.push_back(u);
    if (reduced_) reduced_->linearize(rest_state(nodes));
    set_pattern(matrix, nullptr);
}

void DofMap::Pieces::add(Index from, Index to) {
    if (!all.empty() && all.back().from + all.back().count == from && all.back().to + all.back().count == to)
        ++all.back().count;
    else
        all.push_back({from, to, 1});
}

void DofMap::set_pattern(const SystemMatrix& matrix, const SystemMatrix* layer) {
    std::vector<Index> reduced(full_size_, -1);
    const Index free = static_cast<Index>(free_dofs_.size());
    for (Index k = 0; k < free; ++k) reduced[free_dofs_[k]] = k;
    std::vector<const SystemMatrix*> matrices = {&matrix};
    if (layer) matrices.push_back(layer);
    pieces_.all.clear();
    layer_pieces_.all.clear();
    SparsePattern pattern;
    pattern.size = free + (reduced_ ? reduced_->coordinates() : 0);
    if (reduced_) reduced_->collect_couplings(matrices, reduced, free);
    pattern.column_starts.reserve(pattern.size + 1);
    pattern.rows.reserve(matrix.rows().size() + (layer ? layer->rows().size() : 0));
    pattern.column_starts.push_back(0);
    const LinearTies* ties = ties_of(reduced_);
    const std::set<Index> none;
    for (const Index u : free_dofs_) {
        const std::set<Index>& of_ties = ties ? ties->rows_of(reduced[u], none) : none;
        auto next = of_ties.begin();
        each_entry(matrix, layer, u, [&](Index unknown, Index k, Index l) {
            const Index row = reduced[unknown];
            if (row < 0) return;
            for (; next != of_ties.end() && *next <= row; ++next)
                if (*next < row) pattern.rows.push_back(*next);
            const Index to = static_cast<Index>(pattern.rows.size());
            if (k >= 0) pieces_.add(k, to);
            if (l >= 0) layer_pieces_.add(l, to);
            pattern.rows.push_back(row);
        });
        pattern.rows.insert(pattern.rows.end(), next, of_ties.end());
        if (reduced_) reduced_->append_rows(reduced[u], pattern.rows);
        pattern.column_starts.push_back(static_cast<Index>(pattern.rows.size()));
    }
    if (reduced_) {
        reduced_->append_columns(pattern);
        reduced_->find_entries(matrices, reduced, pattern);
    }
    std::shared_ptr<const SparsePattern>& last = layer ? with_layer_ : without_layer_;
    if (!last || *last != pattern) last = std::make_shared<const SparsePattern>(std::move(pattern));
    pattern_ = last;
}

// Returns the reference state, at which reduced coordinates are linearized before anything has been evaluated.
VectorXd DofMap::rest_state(const Nodes& nodes) {
    VectorXd q = VectorXd::Zero(nodes.n_dofs());
    for (Index node = 0; node < nodes.n_nodes(); ++node) q.segment<3>(3 * node) = nodes.rest[node];
    return q;
}

bool DofMap::axis_aligned(const PrescribedNode& h) const {
    return (h.frame.cwiseAbs().colwise().maxCoeff().array() == 1.0).all();
}

void DofMap::set_values(const Values& values) {
    for (std::size_t k = 0; k < slices_.size(); ++k)
        moves_[k] = {values.vector(slices_[k].center), values.vector(slices_[k].rotation),
                     values.vector(slices_[k].displacement)};
    if (reduced_) reduced_->set_values(values);
}

VectorXd DofMap::prescribed_increment(const VectorXd& q, const LoadParameters& load_parameters) const {
    VectorXd increment = VectorXd::Zero(q.size());
    const double t = support_factor(load_parameters);
    for (const PrescribedNode& h : prescribed_)
        increment.segment<3>(3 * h.node) = prescribed_part(
            h, [&](Index move) -> Vec3 { return position(h.node, move, t) - q.segment<3>(3 * h.node); });
    if (has_motors()) reduced_->add_motor_increment(q, increment);
    const LinearTies* ties = ties_of(reduced_);
    if (!ties) return increment;

    // A displacement is the difference of two positions, and has their round-off.
    const auto round_off = [&](Index dof) {
        const Index node = dof / 3;
        return 2.0 * std::numeric_limits<double>::epsilon() *
               (q.segment<3>(3 * node).norm() + nodes_.rest[node].norm());
    };
    const Frames frames{frame_of_, prescribed_};
    const VectorXd motion = frames.into(q + increment - rest_state(nodes_));
    VectorXd gaps = VectorXd::Zero(q.size());
    for (const TiedDof& each : ties->tied()) {
        double gap = -motion[each.dof], known = round_off(each.dof);
        for (const TiedDof::Part& part : each.parts) {
            gap += part.weight * motion[part.dof];
            known += std::abs(part.weight) * round_off(part.dof);
        }
        for (const TiedDof::Move& move : each.moves)
            gap += t * move.weight * moves_[move.move].translation[move.axis];
        if (std::abs(gap) > known) gaps[each.dof] = gap;
    }
    frames.out_of(gaps);
    return increment + gaps;
}

VectorXd DofMap::along_supports(const VectorXd& full) const {
    const LinearTies* ties = ties_of(reduced_);
    VectorXd parts(3 * (prescribed_.size() + (ties ? ties->tied().size() : 0))), on_others = full;
    if (ties) {
        const Frames frames{frame_of_, prescribed_};
        on_others = frames.into(full);
        Index row = 3 * static_cast<Index>(prescribed_.size());
        for (const TiedDof& each : ties->tied()) {
            parts.segment<3>(row) = frames.direction(each.dof) * on_others[each.dof];
            row += 3;
        }
        ties->gather(on_others);
        frames.out_of(on_others);
    }
    for (std::size_t k = 0; k < prescribed_.size(); ++k)
        parts.segment<3>(3 * static_cast<Index>(k)) = prescribed_part(
            prescribed_[k], [&](Index) -> Vec3 { return on_others.segment<3>(3 * prescribed_[k].node); });
    return parts;
}

Mat3 DofMap::free_motions(Index node) const {
    Mat3 free = Mat3::Identity();
    if (prescribed_at_[node] < 0) return free;
    const PrescribedNode& h = prescribed_[prescribed_at_[node]];
    for (int axis = 0; axis < h.n_prescribed; ++axis)
        free -= h.frame.col(axis) * h.frame.col(axis).transpose();
    return h.n_prescribed == 3 ? Mat3(Mat3::Zero()) : free;
}

// Between two nodes of one symmetry plane, the free part of the block is zero up to round-off.
bool DofMap::acts_on_free_motion(Index a, Index b, const Vec3& axis) const {
    // [-] of the axis; see test_quarter_with_symmetry_planes_equals_the_full_dome
    constexpr double round_off = 1e-10;
    Mat3 across;
    across << 0.0, -axis.z(), axis.y(), axis.z(), 0.0, -axis.x(), -axis.y(), axis.x(), 0.0;
    return (free_motions(a) * across * free_motions(b)).norm() > round_off * axis.norm();
}

VectorXd DofMap::prescribed_rate(const LoadParameters& load_parameters) const {
    VectorXd out = VectorXd::Zero(full_size_);
    const double t = support_factor(load_parameters);
    for (const PrescribedNode& h : prescribed_)
        out.segment<3>(3 * h.node) = prescribed_part(h, [&](Index move) { return rate(h.node, move, t); });
    if (const LinearTies* ties = ties_of(reduced_)) {
        const Frames frames{frame_of_, prescribed_};
        out = frames.into(out);
        ties->extend(out);
        for (const TiedDof& each : ties->tied())
            for (const TiedDof::Move& move : each.moves)
                out[each.dof] += move.weight * moves_[move.move].translation[move.axis];
        frames.out_of(out);
    }
    return out;
}

Vec3 DofMap::position(Index node, Index move, double support_factor) const {
    const Vec3& rest = nodes_.rest[node];
    if (move < 0) return rest;
    return node < nodes_.n_vertices() ? moves_[move].point(rest, support_factor)
                                      : moves_[move].direction(rest, support_factor);
}

Vec3 DofMap::rate(Index node, Index move, double support_factor) const {
    if (move < 0) return Vec3::Zero();
    const Vec3& rest = nodes_.rest[node];
    return node < nodes_.n_vertices() ? moves_[move].point_rate(rest, support_factor)
                                      : moves_[move].direction_rate(rest, support_factor);
}

void DofMap::vjp(const VectorXd& by_state, const VectorXd& lambda, const VectorXd& gradient,
                 const LoadParameters& load_parameters, Gradient& out,
                 const VectorXd& by_motor_forces) const {
    if (reduced_) reduced_->vjp(by_state, lambda, gradient, by_motor_forces, out);
    const double t = support_factor(load_parameters);
    std::vector<SupportMove> by_move(moves_.size());
    VectorXd by_prescribed = by_state;
    if (const LinearTies* ties = ties_of(reduced_)) {
        const Frames frames{frame_of_, prescribed_};
        by_prescribed = frames.into(by_state);
        for (const TiedDof& each : ties->tied())
            for (const TiedDof::Move& move : each.moves) {
                const double by_displacement = move.weight * by_prescribed[each.dof];
                by_move[move.move].translation[move.axis] += t * by_displacement;
                out.load_parameters[support_factor_.first] +=
                    moves_[move.move].translation[move.axis] * by_displacement;
            }
        ties->gather(by_prescribed);
        frames.out_of(by_prescribed);
    }
    for (const PrescribedNode& h : prescribed_)
        for (int axis = 0; axis < h.n_prescribed; ++axis) {
            const Index move = h.moves[axis];
            if (move < 0) continue;
            const Vec3 along = h.frame.col(axis),
                       by_position = along * along.dot(by_prescribed.segment<3>(3 * h.node));
            const Vec3& rest = nodes_.rest[h.node];
            if (h.node < nodes_.n_vertices())
                moves_[move].point_vjp(rest, t, by_position, by_move[move]);
            else
                moves_[move].direction_vjp(rest, t, by_position, by_move[move]);
            out.load_parameters[support_factor_.first] += by_position.dot(rate(h.node, move, t));
        }
    for (std::size_t k = 0; k < slices_.size(); ++k) {
        out.values.segment<3>(slices_[k].center.first) += by_move[k].center;
        out.values.segment<3>(slices_[k].rotation.first) += by_move[k].rotation_vector;
        out.values.segment<3>(slices_[k].displacement.first) += by_move[k].translation;
    }
}

void DofMap::held_rest_vjp(const VectorXd& by_state, const LoadParameters& load_parameters,
                           VectorXd& by_nodes) const {
    const double t = support_factor(load_parameters);
    VectorXd by_prescribed = by_state;
    if (const LinearTies* ties = ties_of(reduced_)) {
        const Frames frames{frame_of_, prescribed_};
        by_prescribed = frames.into(by_state);
        ties->gather(by_prescribed);
        frames.out_of(by_prescribed);
    }
    for (const PrescribedNode& h : prescribed_)
        for (int axis = 0; axis < h.n_prescribed; ++axis) {
            const Vec3 along = h.frame.col(axis),
                       by_position = along * along.dot(by_prescribed.segment<3>(3 * h.node));
            const Index move = h.moves[axis];
            by_nodes.segment<3>(3 * h.node) += move < 0 ? by_position : moves_[move].by_rest(t, by_position);
        }
}

void DofMap::rest_vjp(const VectorXd& by_state, const VectorXd& lambda, const VectorXd& gradient,
                      const VectorXd& by_motor_forces, VectorXd& by_nodes) const {
    if (!reduced_) return;
    reduced_->rest_vjp(by_state, lambda, gradient, by_motor_forces, by_nodes);
    const LinearTies* ties = ties_of(reduced_);
    if (!ties) return;
    const Frames frames{frame_of_, prescribed_};
    VectorXd by_rest = VectorXd::Zero(full_size_);
    ties->add_rest_gradient(frames.into(by_state), by_rest);
    frames.out_of(by_rest);
    by_nodes += by_rest.head(by_nodes.size());
}

double DofMap::largest_rotation() const {
    double turn = 0.0;
    for (const SupportMove& move : moves_) turn = std::max(turn, move.rotation_vector.norm());
    return turn;
}

// Rotates B_ij -> Q_i^T B_ij Q_j if node i or j is rotated. The rows of a node's three columns are stored as system_matrix.h says.
void DofMap::rotate_blocks(SystemMatrix& full) const {
    const Index rotations_from = 3 * full.nodes();
    const auto frame = [&](Index node) -> const Mat3& { return prescribed_[frame_of_[node]].frame; };
    for (Index j = 0; j < full.nodes(); ++j) {
        const Index length = full.column_length(j);
        const Index start = full.column_starts()[3 * j];
        const Index starts[3] = {
            start, start + length - 1,
            start + 2 * length - 3};  // where column 0 of the row begins, in each of the three columns
        double* values = full.values().data();
        if (frame_of_[j] >= 0) {
            double &a = values[starts[0]], &b = values[starts[0] + 1], &c = values[starts[0] + 2];
            double &d = values[starts[1] + 1], &e = values[starts[1] + 2], &f = values[starts[2] + 2];
            Mat3 block;
            block << a, b, c, b, d, e, c, e, f;
            const Mat3 turned = frame(j).transpose() * block * frame(j);
            a = turned(0, 0), b = turned(1, 0), c = turned(2, 0), d = turned(1, 1), e = turned(2, 1),
            f = turned(2, 2);
        }
        for (Index k = 3; k < length; ++k) {
            const Index row = full.rows()[start + k];
            if (row >= rotations_from) {
                if (frame_of_[j] < 0) continue;
                Vec3 entry(values[starts[0] + k], values[starts[1] + k], values[starts[2] + k]);
                entry = frame(j).transpose() * entry;
                for (int c = 0; c < 3; ++c) values[starts[c] + k] = entry[c];
                continue;
            }
            const Index i = row / 3;
            if (frame_of_[i] >= 0 || frame_of_[j] >= 0) {
                Mat3 block;
                for (int c = 0; c < 3; ++c)
                    for (int r = 0; r < 3; ++r) block(r, c) = values[starts[c] + k + r];
                if (frame_of_[i] >= 0) block = (frame(i).transpose() * block).eval();
                if (frame_of_[j] >= 0) block = (block * frame(j)).eval();
                for (int c = 0; c < 3; ++c)
                    for (int r = 0; r < 3; ++r) values[starts[c] + k + r] = block(r, c);
            }
            k += 2;
        }
    }
}

void DofMap::matrix(SystemMatrix& full, SystemMatrix* layer, LargeVector<double>& values) const {
    if (!frame_of_.empty()) {
        rotate_blocks(full);
        if (layer) rotate_blocks(*layer);
    }
    values.resize(pattern_->rows.size());
    if (reduced_ || layer) std::fill(values.begin(), values.end(), 0.0);
    for (const Pieces::Piece& piece : pieces_.all)
        std::copy_n(full.values().data() + piece.from, piece.count, values.data() + piece.to);
    if (reduced_) reduced_->add_matrix(0, full, values.data());
    if (!layer) return;
    for (const Pieces::Piece& piece : layer_pieces_.all)
        for (Index k = 0; k < piece.count; ++k) values[piece.to + k] += layer->values()[piece.from + k];
    if (reduced_) reduced_->add_matrix(1, *layer, values.data());
}

void DofMap::add_weights(const VectorXd& full, LargeVector<double>& values) const {
    for (std::size_t k = 0; k < free_dofs_.size(); ++k)
        values[pattern_->column_starts[k]] += full[free_dofs_[k]];
    if (reduced_) reduced_->add_weights(full, values.data());
}

VectorXd DofMap::vector(const VectorXd& full) const {
    return frame_of_.empty() ? gathered(full) : gathered(Frames{frame_of_, prescribed_}.into(full));
}

VectorXd DofMap::gathered(const VectorXd& full) const {
    VectorXd reduced(size());
    for (std::size_t k = 0; k < free_dofs_.size(); ++k) reduced[k] = full[free_dofs_[k]];
    if (reduced_) reduced_->pull_back(full, reduced);
    return reduced;
}

VectorXd DofMap::project(const VectorXd& full) const {
    VectorXd reduced = vector(full);
    if (const LinearTies* ties = ties_of(reduced_)) {
        const VectorXd forces = reduced;
        ties->solve(VectorXd::Ones(full_size_), forces, reduced);
        return expand(reduced);
    }
    VectorXd projected = expand(reduced);
    if (!reduced_) return projected;
    VectorXd on_bodies = full;
    reduced_->project(on_bodies);
    reduced_->replace(on_bodies, projected);
    return projected;
}

VectorXd DofMap::acceleration(const VectorXd& mass, const VectorXd& force) const {
    const VectorXd forces = vector(force);
    VectorXd reduced = forces;
    for (std::size_t k = 0; k < free_dofs_.size(); ++k) {
        const double m = mass[free_dofs_[k]];
        reduced[static_cast<Index>(k)] = m != 0.0 ? reduced[static_cast<Index>(k)] / m : 0.0;
    }
    reduced.tail(reduced.size() - static_cast<Index>(free_dofs_.size())).setZero();
    if (const LinearTies* ties = ties_of(reduced_)) ties->solve(mass, forces, reduced);
    VectorXd full = expand(reduced);
    if (reduced_) reduced_->accelerate(mass, force, full);
    return full;
}

void DofMap::retract(VectorXd& q, const VectorXd& p) const {
    if (reduced_)
        reduced_->retract(q, p);
    else
        q += p;
}

VectorXd DofMap::weights(const VectorXd& full) const {
    VectorXd reduced(size());
    for (std::size_t k = 0; k < free_dofs_.size(); ++k) reduced[k] = full[free_dofs_[k]];
    if (reduced_) reduced_->diagonal(full, reduced);
    return reduced;
}

std::vector<Vec3> DofMap::free(const std::vector<Vec3>& full) const {
    std::vector<Vec3> points;
    points.reserve(free_dofs_.size());
    for (const Index unknown : free_dofs_) points.push_back(full[unknown]);
    if (reduced_) reduced_->append_points(full, points);
    return points;
}

VectorXd DofMap::expand(const VectorXd& reduced) const {
    VectorXd full = VectorXd::Zero(full_size_);
    for (std::size_t k = 0; k < free_dofs_.size(); ++k) full[free_dofs_[k]] = reduced[k];
    if (reduced_) reduced_->push_forward(reduced, full);
    if (!frame_of_.empty()) Frames{frame_of_, prescribed_}.out_of(full);
    return full;
}

std::size_t DofMap::bytes() const {
    return (pieces_.all.capacity() + layer_pieces_.all.capacity()) * sizeof(Pieces::Piece) +
           (frame_of_.capacity() + prescribed_at_.capacity() + free_dofs_.capacity() +
            pattern_->rows.capacity() + pattern_->column_starts.capacity()) *
               sizeof(Index) +
           (reduced_ ? reduced_->bytes() : 0);
}

DofMap::~DofMap() = default;

bool DofMap::has_motors() const {
    return reduced_ && reduced_->has_motors();
}

bool DofMap::has_values() const {
    return has_prescribed_motion() || (reduced_ && reduced_->has_joint_parameters());
}

void DofMap::add_motor_increment_forces(const VectorXd& gradient, const VectorXd& move,
                                        VectorXd& forces) const {
    if (has_motors()) reduced_->add_motor_increment_forces(gradient, move, forces);
}

VectorXd DofMap::motor_forces(const VectorXd& gradient) const {
    return has_motors() ? reduced_->motor_forces(gradient) : VectorXd();
}

VectorXd DofMap::motor_motion(const VectorXd& by_motor_forces) const {
    return reduced_->motor_motion(by_motor_forces);
}

void DofMap::add_motor_force_change(const VectorXd& gradient, const VectorXd& by_motor_forces,
                                    VectorXd& forces) const {
    reduced_->add_motor_force_change(gradient, by_motor_forces, forces);
}

std::vector<const RigidNodes*> DofMap::free_bodies() const {
    return reduced_ ? reduced_->free_bodies() : std::vector<const RigidNodes*>();
}

void DofMap::linearize(const VectorXd& q) {
    if (reduced_) reduced_->linearize(q);
}

void DofMap::add_curvature(const VectorXd& gradient, LargeVector<double>& values) const {
    if (reduced_) reduced_->add_curvature(gradient, values.data());
}

void DofMap::add_curvature_product(const VectorXd& gradient, const VectorXd& reduced, VectorXd& out) const {
    if (reduced_) reduced_->add_curvature_product(gradient, reduced, out);
}

void DofMap::add_curvature_forces(const VectorXd& gradient, const VectorXd& motion, VectorXd& forces) const {
    if (reduced_) reduced_->add_curvature_forces(gradient, motion, forces);
}

VectorXd DofMap::rounding(const VectorXd& q) const {
    return reduced_ ? reduced_->rounding(q) : VectorXd();
}

void DofMap::project_state(VectorXd& q, VectorXd* v) const {
    if (reduced_) reduced_->project_state(q, v);
}

void DofMap::project_state_vjp(const VectorXd& q, const VectorXd& v, VectorXd& by_q, VectorXd& by_v,
                               Gradient& out, VectorXd* by_rest) const {
    if (reduced_) reduced_->project_state_vjp(q, v, by_q, by_v, out, by_rest);
}

}  // namespace magshell
