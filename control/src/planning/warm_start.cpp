#include "palanquin/control/planning/warm_start.hpp"

#include <algorithm>

namespace palanquin::planning {

namespace {
/// Feet in the air push with less than this, N: in the paper's unreduced form their forces are
/// variables, which the solver leaves at some rounding error.
constexpr double kNoForce = 1e-3;
}  // namespace

WarmStart::WarmStart(const LoweredProblem& problem, const Team& team, const TeamSlots& slots,
                     int horizon, int other_starts)
    : problem_(problem),
      team_(team),
      slots_(slots),
      neutral_(neutral_trajectory(problem, horizon)),
      aims_(RowMatrix::Zero(horizon + 1, 3 * team.feet())),
      feet_(aims_),
      starts_(other_starts, horizon, team.feet()),
      other_feet_(static_cast<std::size_t>(other_starts), aims_) {}

void WarmStart::guess(const Instant& now, const LastPlan& last, const StandingGround& ground,
                      const Eigen::VectorXd& stance, VectorView spacing, RowMatrix& guess) {
  if (last.exists) {
    shift_last(now, last, spacing, guess);
    keep_landings(now, last, spacing, guess);
    lift_feet(now, last, spacing, guess);
  } else {
    start_from_references(now, guess);
  }
  if (ground.is_whole() && other_feet_.empty()) return;
  find_aims(now, ground.terrain(), stance);
  if (!ground.is_whole()) clear_feet(now, last, ground, spacing, guess);
}

/// The references, with forces that carry the weight.
void WarmStart::start_from_references(const Instant& now, RowMatrix& guess) {
  guess = neutral_;
  for (Eigen::Index k = 0; k < guess.rows(); ++k) {
    double* z = &guess(k, 0);
    slots_.write_bodies(&now.references.bodies(k, 0), z);
    for (int i = 0; i < team_.feet(); ++i) {
      point(feet_, k, i) = now.references.foot(k, i);
      Eigen::Map<Vector3>(z + slots_.forces[i]) = carrying_force(team_, now.contacts, k, i);
    }
    for (const auto& hand : slots_.hands) Eigen::Map<Vector3>(z + hand[0]) = team_.share();
  }
  now.carry(feet_);
  write_feet(feet_, guess);
}

/// The last plan as seen later. Where a foot stands that it had in the air, the foot starts with
/// its share of the weight: at zero force all its friction rows are at their kinks, from which the
/// subproblem frees itself in steps of the penalties' smoothing width.
void WarmStart::shift_last(const Instant& now, const LastPlan& last, VectorView spacing,
                           RowMatrix& guess) {
  shift(problem_, last.trajectory, spacing, now.time - last.time, guess);
  for (Eigen::Index k = 0; k < guess.rows(); ++k)
    for (int i = 0; i < team_.feet(); ++i) {
      Eigen::Map<Vector3> force(&guess(k, slots_.forces[i]));
      if (now.contacts(k, i) && force.cwiseAbs().maxCoeff() < kNoForce)
        force = carrying_force(team_, now.contacts, k, i);
    }
}

/// Starts feet that will land where the last plan has them land. Between two of its knots, a foot
/// in the air at the first and down at the second, shifting would take the first one's, which is
/// nowhere in particular: of a foot beside a ditch perhaps on its other side.
void WarmStart::keep_landings(const Instant& now, const LastPlan& last, VectorView spacing,
                              RowMatrix& guess) {
  const Eigen::Index horizon = guess.rows() - 1;
  const double elapsed = now.time - last.time, late = 1e-6 * spacing[0];
  Eigen::Index before = 0;  // the last plan's knot at a time
  double time = 0.0, time_of_next = spacing[0];
  for (Eigen::Index k = 0; k <= horizon; ++k) {
    while (before + 1 < horizon && time_of_next <= elapsed + time + late)
      time_of_next += spacing[++before];
    if (before + 1 == horizon) return;  // the last knot has no feet of its own
    for (int i = 0; i < team_.feet(); ++i)
      if (now.contacts(k, i) && !last.contacts(before, i) && last.contacts(before + 1, i))
        Eigen::Map<Vector3>(&guess(k, slots_.feet[i])) =
            Eigen::Map<const Vector3>(&last.trajectory(before + 1, slots_.feet[i]));
    time += spacing[k];
  }
}

/// Starts feet from their references where they swing and the last plan had them stand. Stretched
/// as they stood, they would start on their reach's limit, and a step would slide them along its
/// tangent: 4 cm too far in one case.
void WarmStart::lift_feet(const Instant& now, const LastPlan& last, VectorView spacing,
                          RowMatrix& guess) {
  const Eigen::Index horizon = guess.rows() - 1;
  const double elapsed = now.time - last.time, late = 1e-6 * spacing[0];
  // The last plan's knot at a time; its last knot has no feet of its own: it is given those of the
  // one before.
  Eigen::Index before = 0;
  double time = 0.0, time_of_next = spacing[0];
  for (Eigen::Index k = 0; k <= horizon; ++k) {
    while (before + 1 < horizon && time_of_next <= elapsed + time + late)
      time_of_next += spacing[++before];
    for (int i = 0; i < team_.feet(); ++i)
      if (last.contacts(before, i) && !now.contacts(k, i))
        Eigen::Map<Vector3>(&guess(k, slots_.feet[i])) = now.references.foot(k, i);
    time += spacing[k];
  }
}

void WarmStart::clear_feet(const Instant& now, const LastPlan& last, const StandingGround& ground,
                           VectorView spacing, RowMatrix& guess) {
  const Eigen::Index horizon = guess.rows() - 1;
  const double end = spacing.head(horizon).sum() - spacing[horizon] / 2;
  const double elapsed = now.time - last.time;
  double time = 0.0;
  for (Eigen::Index k = 0; k <= horizon; ++k) {
    const bool is_planned = last.exists && elapsed + time < end;
    for (int i = 0; i < team_.feet(); ++i)
      if (is_planned && now.contacts(k, i))
        point(feet_, k, i) = Eigen::Map<const Vector3>(&guess(k, slots_.feet[i]));
      else
        point(feet_, k, i) = ground.nearest(point(aims_, k, i), now.is_landing(k, i));
    time += spacing[k];
  }
  now.carry(feet_);
  write_feet(feet_, guess);
}

/// Reference feet, landing below where the hip is in the middle of the stance: a foothold is chosen
/// when its touchdown comes into the horizon, as it suits the whole stance.
void WarmStart::find_aims(const Instant& now, const Terrain& terrain,
                          const Eigen::VectorXd& stance) {
  for (Eigen::Index k = 0; k < aims_.rows(); ++k)
    for (int i = 0; i < team_.feet(); ++i) {
      Vector3 aim = now.references.foot(k, i);
      if (now.is_landing(k, i)) {
        const ConstBodyState robot(now.references.bodies, k, 1 + i / kFeet);
        aim.head<2>() += stance[i] / 2 * robot.velocity.head<2>();
        aim.z() = terrain.height(aim.x(), aim.y());
      }
      point(aims_, k, i) = aim;
    }
}

int WarmStart::choose(const Instant& now, const StandingGround& ground,
                      std::vector<RowMatrix>& guesses) {
  const int others = starts_.make(aims_, now, ground, other_feet_);
  for (int n = 0; n < others; ++n) {
    RowMatrix& other = guesses[static_cast<std::size_t>(n) + 1];
    other = guesses.front();
    now.carry(other_feet_[static_cast<std::size_t>(n)]);
    write_feet(other_feet_[static_cast<std::size_t>(n)], other);
  }
  return 1 + others;
}

void WarmStart::write_feet(const RowMatrix& feet, RowMatrix& guess) const {
  for (Eigen::Index k = 0; k < guess.rows(); ++k)
    for (int i = 0; i < team_.feet(); ++i)
      Eigen::Map<Vector3>(&guess(k, slots_.feet[i])) = point(feet, k, i);
}

}  // namespace palanquin::planning
