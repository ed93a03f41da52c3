// Complement: the space around a body, as an obstacle, which keeps other bodies inside that body.
#pragma once

#include <memory>
#include <utility>

#include "magshell/obstacle/obstacle.h"

namespace magshell {

class Complement final : public Obstacle {
  public:
    explicit Complement(std::shared_ptr<const Obstacle> body) : body_(std::move(body)) {}

    Distance distance(const Vec3& point) const override {
        const Distance d = body_->distance(point);
        return {-d.value, -d.normal, -d.curvature};
    }

  private:
    std::shared_ptr<const Obstacle> body_;
};

}  // namespace magshell
