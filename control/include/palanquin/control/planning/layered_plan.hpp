#pragma once

#include <string>
#include <vector>

#include "palanquin/control/planning/bar_team.hpp"
#include "palanquin/solvers/status.hpp"

namespace palanquin::planning {

/// A plan of one sample of M robots on bars with L rows, over N intervals.
struct LayeredPlan {
  double time = 0.0;  ///< when it was made, s
  double dt = 0.0;    ///< length of an interval, s
  RowMatrix states;   ///< (r, v, xi, w) at all knots, xi about `operating`, [N + 1, 12 M]
  std::vector<Matrix3> operating;  ///< rotations R_op, body to world, [M]
  RowMatrix inputs;                ///< ground reaction forces, world, N, [N, 12 M]
  RowMatrix bars;                  ///< multipliers [N, L]; for a free bar N/m
  RowMatrix estimates;  ///< each robot's own, at the first knot, [M, L]; NaN of others' bars
  Status status = Status::NotSolved;
  bool is_usable = false;    ///< whether it is a solution; if not, it is the last one, shifted
  std::string event;         ///< what went wrong, in words; empty unless something did
  double solve_ms = 0.0;     ///< from the states to this plan, all robots' QPs one after the other
  std::vector<double> cost;  ///< optimal, constants included: one, or one a robot

  int horizon() const { return static_cast<int>(inputs.rows()); }
  int robots() const { return static_cast<int>(operating.size()); }
  /// Moves on by `elapsed` seconds; its end is held.
  void shift(double elapsed);
  /// Leaves forces only to feet that stand, by contacts [N + 1, 4 M].
  void lift_feet(const Flags& contacts);
};

}  // namespace palanquin::planning
