#pragma once

#include <memory>

#include "palanquin/control/planning/foothold_starts.hpp"
#include "palanquin/control/planning/standing_ground.hpp"
#include "palanquin/control/planning/team_slots.hpp"

namespace palanquin::planning {

/// The last plan, as far as the next start needs it.
struct LastPlan {
  bool exists = false;
  double time = 0.0;     ///< what it is for, s
  RowMatrix trajectory;  ///< [N + 1, nz]
  Flags contacts;        ///< [N + 1, 4 R]
};

/// Where a solve starts: the last plan, shifted, or the references; and other footholds to try.
/// Does not allocate but for construction.
class WarmStart {
 public:
  /// Keeps references to problem, team and slots. At most so many other footholds are tried.
  WarmStart(const LoweredProblem& problem, const Team& team, const TeamSlots& slots, int horizon,
            int other_starts);

  /// The last plan as seen `elapsed` seconds later; without one, the references.
  ///
  /// Where feet may not stand everywhere, those that no plan has placed on the ground yet start
  /// where they may: one that was in the air at the last plan's end would otherwise keep to the
  /// near side of a ditch, step after step, long after the reference has crossed.
  ///
  /// `stance` [4 R] is how long each foot stands, s; 0 for one whose reference footholds are those
  /// of the whole stance already. `spacing` [N + 1] are the knots' distances, s.
  void guess(const Instant& now, const LastPlan& last, const StandingGround& ground,
             const Eigen::VectorXd& stance, VectorView spacing, RowMatrix& guess);

  /// Copies of guesses[0] whose feet land elsewhere, into guesses[1] and on; returns how many
  /// guesses there are then.
  int choose(const Instant& now, const StandingGround& ground, std::vector<RowMatrix>& guesses);

 private:
  void start_from_references(const Instant& now, RowMatrix& guess);
  void shift_last(const Instant& now, const LastPlan& last, VectorView spacing, RowMatrix& guess);
  void keep_landings(const Instant& now, const LastPlan& last, VectorView spacing,
                     RowMatrix& guess);
  void lift_feet(const Instant& now, const LastPlan& last, VectorView spacing, RowMatrix& guess);
  void clear_feet(const Instant& now, const LastPlan& last, const StandingGround& ground,
                  VectorView spacing, RowMatrix& guess);
  void find_aims(const Instant& now, const Terrain& terrain, const Eigen::VectorXd& stance);
  void write_feet(const RowMatrix& feet, RowMatrix& guess) const;

  const LoweredProblem& problem_;
  const Team& team_;
  const TeamSlots& slots_;
  RowMatrix neutral_;
  RowMatrix aims_;  ///< where feet should land, whatever the ground there, world, m, [N + 1, 12 R]
  RowMatrix feet_;
  FootholdStarts starts_;
  std::vector<RowMatrix> other_feet_;
};

}  // namespace palanquin::planning
