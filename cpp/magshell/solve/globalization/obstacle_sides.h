// The sides of obstacles on which contact points are, from one state of a solve to the next.
//
// The penalty of an obstacle pushes a point out on the nearest side. A point that has come past the middle of the obstacle
// between two states would be pushed out on the wrong side, and the equilibrium that is found there is not the one that
// continuous motion leads to. So load steps, relaxation steps and steps along a path are kept so short that no point passes.
//
// Contact acts at points only, and a small obstacle may slip between them. Where obstacles move, no face may sweep over the middle of
// one either.
#pragma once

#include <string>
#include <vector>

#include "magshell/scene/model.h"

namespace magshell {

/// Watches obstacles of a model for as long as it lives.
class ScopedWatch {
  public:
    ScopedWatch(const Model& model, const std::vector<WatchedObstacle>& watched)
        : model_(model), is_watching_(!watched.empty()) {
        if (is_watching_) model_.contacts().watch(model_.nodes(), watched);
    }
    ScopedWatch(const ScopedWatch&) = delete;
    ScopedWatch& operator=(const ScopedWatch&) = delete;
    ~ScopedWatch() {
        if (is_watching_) model_.contacts().watch(model_.nodes(), {});
    }

  private:
    const Model& model_;
    bool is_watching_;
};

class ObstacleSides {
  public:
    /// The model has to outlive it.
    explicit ObstacleSides(const Model& model) : model_(model) {}

    /// Remembers where the contact points are relative to the obstacles, which stand where the model has them now.
    void remember(const VectorXd& q, const LoadParameters& load_parameters);
    /// Returns why a state cannot follow the remembered one, in words: a point would pass through an obstacle on the straight
    /// way between them, in the frame of the obstacle. Empty where none does.
    std::string crossed(const VectorXd& q, const LoadParameters& load_parameters) const;
    /// Returns the largest turn of an obstacle since the remembered state [rad]: an upper bound, full turns count.
    double turned(const LoadParameters& load_parameters) const;

  private:
    const Model& model_;
    Contacts::ObstacleFrames frames_;
};

}  // namespace magshell
