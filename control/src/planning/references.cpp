#include "palanquin/control/planning/references.hpp"

#include <cmath>

namespace palanquin::planning {

PathKnot step_along(const Terrain& ground, const Pose& start, const Velocity& command, double dt) {
  const Vector2 s = ground.slope(start.x, start.y);
  const double cos = std::cos(start.yaw), sin = std::sin(start.yaw);
  const Vector2 c(cos * command.vx - sin * command.vy, sin * command.vx + cos * command.vy);
  const double length = std::sqrt(1.0 + s.x() * s.x() + s.y() * s.y());
  const double along = (s.x() * c.x() + s.y() * c.y()) / (length * (1.0 + length));
  return {{start.x + dt * (c.x() - along * s.x()), start.y + dt * (c.y() - along * s.y()),
           start.yaw + dt * command.wz},
          s};
}

void payload_path(const Terrain& ground, const Pose& start, const Velocity& command, double dt,
                  std::vector<PathKnot>& path) {
  Pose pose = start;
  for (PathKnot& knot : path) {
    const PathKnot next = step_along(ground, pose, command, dt);
    knot = {pose, next.slope};
    pose = next.pose;
  }
}

ReferenceMotion::ReferenceMotion(const Team& team, const Terrain& terrain, RobotReferences robots,
                                 int horizon, double dt)
    : team_(team),
      terrain_(terrain),
      trend_(terrain.trend()),
      robots_(robots),
      dt_(dt),
      path_(static_cast<std::size_t>(horizon) + 2),
      bodies_(RowMatrix::Zero(horizon + 2, kState * team.bodies())) {}

void ReferenceMotion::make(const Pose& start, const Velocity& command, References& references) {
  payload_path(trend_, start, command, dt_, path_);
  move_rigidly(command);
  if (robots_ == RobotReferences::Ground && !trend_.is_plane()) follow_ground();
  references.bodies = bodies_.topRows(bodies_.rows() - 1);
  project_hips(references);
}

/// States of payload and robots that move along the path as one rigid body (14).
///
/// The payload's heading frame is tilted onto the ground below it, over which it keeps its height.
/// As printed, (14b) adds the world velocity of the hand to a vector of mixed frames. The rigid
/// motion that the text describes is v_i* = v_0* + (q_0* Omega_0*) x (p_i* - p_0*).
void ReferenceMotion::move_rigidly(const Velocity& command) {
  for (Eigen::Index k = 0; k < bodies_.rows(); ++k) {
    const PathKnot& knot = path_[static_cast<std::size_t>(k)];
    const Vector3 origin(knot.pose.x, knot.pose.y,
                         trend_.height(knot.pose.x, knot.pose.y) + team_.payload.height);
    const Vector4 orientation = on_slope(knot.slope, knot.pose.yaw);
    const Matrix3 axes = rotation_matrix(orientation);
    const auto move = [&](int b, const Vector3& offset, const Vector4& turned) {
      BodyState body(bodies_, k, b);
      body.position = origin + axes * offset;  // (14a)
      body.orientation = turned;
      body.velocity = axes * Vector3(command.vx - command.wz * offset.y(),  // (14b)
                                     command.vy + command.wz * offset.x(), 0.0);
      // (14c): robots are turned about the payload's z axis only.
      body.angular_velocity = Vector3(0.0, 0.0, command.wz);
    };
    move(0, Vector3::Zero(), orientation);
    for (int r = 0; r < team_.robots(); ++r) {
      const Place& place = team_.places[static_cast<std::size_t>(r)];
      move(r + 1, place.offset, quaternion_multiply(orientation, place.turn));
    }
  }
}

/// Has each robot stand as the payload does in (14), but over its own ground, within the reach of
/// its legs: over the upper edge of a ramp a rigid team has its hind hips higher over the ground
/// than legs can reach (Figure 7 of the paper). Its heading stays, it is tilted onto the plane
/// through the ground under its hips, and its height over that plane is what (14) gives on a slope
/// without end. On planes this is (14) itself. The arm takes up the difference. Velocities take the
/// robots from each knot to the next; the last one's stay.
void ReferenceMotion::follow_ground() {
  for (int r = 0; r < team_.robots(); ++r) {
    const Carrier& carrier = team_.carriers[static_cast<std::size_t>(r)];
    const Place& place = team_.places[static_cast<std::size_t>(r)];
    const double arm = carrier.attach.z() - carrier.hand.z();
    for (Eigen::Index k = 0; k < bodies_.rows(); ++k) {
      BodyState body(bodies_, k, r + 1);
      const Matrix3 axes = rotation_matrix(body.orientation);
      Vector4 gap;
      for (int f = 0; f < kFeet; ++f) {
        const Vector3& hip = carrier.hips[static_cast<std::size_t>(f)];
        const Vector3 below = body.position + axes * Vector3(hip.x(), hip.y(), 0.0);
        gap[f] = below.z() - trend_.height(below.x(), below.y());
      }
      // gap = centre + along u + across v over the hips' coordinates (u, v)
      const Vector3 fit = place.ground_fit * gap;
      const Vector3 down(0.0, 0.0, 1.0);
      const Vector3 normal = (axes.col(0) - fit[1] * down).cross(axes.col(1) - fit[2] * down);
      const Vector2 slope = -normal.head<2>() / normal.z();
      const double steepness = std::sqrt(1.0 + slope.squaredNorm());  // 1 / n_z
      body.position.z() += team_.payload.height + arm * steepness - fit[0];
      body.orientation = on_slope(slope, path_[static_cast<std::size_t>(k)].pose.yaw + carrier.yaw);
    }
    for (Eigen::Index k = 0; k + 1 < bodies_.rows(); ++k) {
      BodyState now(bodies_, k, r + 1);
      const BodyState later(bodies_, k + 1, r + 1);
      now.velocity = (later.position - now.position) / dt_;
      now.angular_velocity = quaternion_minus(later.orientation, now.orientation) / dt_;
    }
  }
}

/// Footholds r_f*: hips of the reference pose, or what else the feet are below, projected down to
/// the ground.
void ReferenceMotion::project_hips(References& references) const {
  references.footholds.resize(references.bodies.rows(), 3 * team_.feet());
  for (Eigen::Index k = 0; k < references.bodies.rows(); ++k)
    for (int r = 0; r < team_.robots(); ++r) {
      const ConstBodyState robot(references.bodies, k, r + 1);
      const Matrix3 axes = rotation_matrix(robot.orientation);
      for (int i = kFeet * r; i < kFeet * (r + 1); ++i) {
        Vector3 foothold = axes * team_.above_foot(i);
        const Vector2 hip = robot.position.head<2>() + foothold.head<2>();
        foothold.z() = terrain_.height(hip.x(), hip.y()) - robot.position.z();
        point(references.footholds, k, i) = foothold;
      }
    }
}

TeamState nominal_state(const Team& team, const Terrain& terrain, const Pose& pose,
                        RobotReferences robots) {
  References references;
  ReferenceMotion(team, terrain, robots, 0, 1.0).make(pose, {}, references);
  TeamState state{references.bodies.reshaped<Eigen::RowMajor>(team.bodies(), kState),
                  RowMatrix(team.feet(), 3)};
  for (int i = 0; i < team.feet(); ++i) point(state.feet, i, 0) = references.foot(0, i);
  return state;
}

Vector4 on_slope(const Vector2& slope, double yaw) {
  const double cos = std::cos(yaw / 2), sin = std::sin(yaw / 2);
  // With the normal's n_z = 1 / l the tilt is (h, s_y, -s_x, 0) with h and s scaled as below.
  const double inverse = 1.0 / std::sqrt(1.0 + slope.squaredNorm());
  const double half = std::sqrt((1.0 + inverse) / 2);
  const double scale = inverse / (2.0 * half);
  const double about_x = scale * slope.y(), about_y = -scale * slope.x();
  return {half * cos, about_x * cos + about_y * sin, about_y * cos - about_x * sin, half * sin};
}

Vector4 from_yaw(double yaw) { return {std::cos(yaw / 2), 0.0, 0.0, std::sin(yaw / 2)}; }

Matrix3 rotation_matrix(const Vector4& q) {
  return Eigen::Quaterniond(q[0], q[1], q[2], q[3]).toRotationMatrix();
}

}  // namespace palanquin::planning
