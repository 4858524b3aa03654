#pragma once

#include "palanquin/control/whole_body/task_targets.hpp"

namespace palanquin {

/// The path of a swing foot: Bezier polynomials from where it lifted off to its foothold, with
/// neither velocity nor acceleration at both ends. Horizontally of degree 5, vertically of degree
/// 6, whose middle control point puts the foot `clearance` (m) over the higher end at half time.
///
/// `progress` is the share of the swing that is over, from 0 to 1, and `duration` (s) its length.
PointTarget swing_target(const Vector3& lift_off, const Vector3& foothold, double clearance,
                         double progress, double duration);

/// What a foothold is chosen from; world axes, m and m/s.
struct FootholdInput {
  Vector3 hip = Vector3::Zero();                 ///< above which the foot stands by default
  Vector3 velocity = Vector3::Zero();            ///< of the hip, as measured
  Vector3 commanded_velocity = Vector3::Zero();  ///< of the hip, over a stride
  double remaining = 0;                          ///< time to the touchdown, s
  double stance_duration = 0.2;                  ///< of the stance that follows, s
  double velocity_gain = 0.1;                    ///< s
  double farthest = 0.2;                         ///< from below the hip, m
  double ground = 0;                             ///< height of the ground, m
  double height = 0.26;                          ///< of the centre of mass over it, m
};

/// Raibert's foothold ("Legged Robots That Balance", 1986, eq. 2.4): below where the hip will be,
/// half a stance ahead, and further by the excess of velocity,
///   hip + v remaining + v' T_stance / 2 + k (v' - v_cmd),
/// where v' is the velocity that the measured one leads to, as a mean over the stance: an inverted
/// pendulum of that height is faster at its touchdown, by a / tanh(a) with a = T/2 sqrt(g / h),
/// 1.12 for 0.2 s and 0.26 m. Taken for the mean, that excess makes a trot 10 % too slow. With
/// k + T/2 = a / tanh(a) / (w tanh(w T)), w = sqrt(g / h), the velocity is right after one step:
/// k is 0.12 s here.
Vector3 raibert_foothold(const FootholdInput& input);

}  // namespace palanquin
