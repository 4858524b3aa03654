#pragma once

#include <vector>

#include "palanquin/control/planning/bar_planner.hpp"
#include "palanquin/control/whole_body/robot_target.hpp"

namespace palanquin {

/// What the controllers of robots on bars are given of a plan, one each: the next knot, the forces
/// until then, and the accelerations that forces, gravity and bars give, which are the change of
/// velocity over the first interval.
std::vector<RobotTarget> targets_of(const planning::BarPlan& plan);

}  // namespace palanquin
