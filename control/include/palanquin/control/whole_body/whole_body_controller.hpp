#pragma once

#include <Eigen/Cholesky>
#include <Eigen/Core>
#include <string>
#include <vector>

#include "palanquin/control/whole_body/robot_model.hpp"
#include "palanquin/solvers/dense_qp.hpp"

namespace palanquin {

/// Of a virtual constraint: y'' = y''_des - kp (y - y_des) - kd (y' - y'_des).
struct Gains {
  double kp;  ///< 1/s^2
  double kd;  ///< 1/s
};

struct WholeBodySettings {
  double torque_weight = 1e2;  ///< gamma_1 of (28); the three weights are V-A.3's
  double force_weight = 1e4;   ///< gamma_2
  double slack_weight = 1e6;   ///< gamma_3
  Gains com{100, 20};
  Gains orientation{400, 40};
  Gains point{900, 60};  ///< of swing feet
  Gains joint{100, 20};
  double contact_damping = 20;  ///< standing points: J v' + drift = -damping * velocity, 1/s
  double largest_force = 400;   ///< normal force of a contact with friction, N
  int hold_periods = 20;        ///< for which torques are held when the QP fails

  /// What is wrong with it, in words; empty if nothing.
  std::string explain_invalid() const;
};

/// Where a point should be, in world axes.
struct PointTarget {
  Vector3 position = Vector3::Zero(), velocity = Vector3::Zero(), acceleration = Vector3::Zero();
};

/// How the base should be turned; rate and its derivative in body axes.
struct OrientationTarget {
  Vector4 orientation{1, 0, 0, 0};  ///< (w, x, y, z)
  Vector3 rate = Vector3::Zero(), acceleration = Vector3::Zero();
};

/// A point that pushes against something that does not move.
struct Contact {
  int point = 0;
  Vector3 force = Vector3::Zero();  ///< desired, of the world on the robot, world axes, N
  double friction = 0.6;            ///< mu on level ground; negative: a grasp, any force is allowed
};

struct WholeBodyResult {
  Status status = Status::NotSolved;
  bool is_fallback = false;  ///< the torques are not this period's QP's
  Eigen::VectorXd torques;   ///< [n], N m, always finite and within the limits
  Eigen::Matrix3Xd forces;   ///< [3, contacts] in the order they were added, N; 0 in a fallback
  Eigen::VectorXd slack;     ///< delta of (28), in the order of the outputs
  int active_rows_changed = 0;
};

/// The whole-body QP of one robot and one period, (25)-(28) of Kim et al.:
///
///   min  g1/2 |tau|^2 + g2/2 |f - f_des|^2 + g3/2 |delta|^2   over tau, f
///   s.t. y'' = -Kp y - Kd y' + delta   virtual constraints, by input-output linearisation (26)
///        r'' = 0                       of the points in contact (27)
///        |tau| <= limit,  |f_x|, |f_y| <= mu / sqrt(2) f_z,  0 <= f_z
///
/// The accelerations come from the dynamics, v' = D^-1 ([0; tau] + sum J'f - H), and delta from
/// (26), so that only tau and f are left as unknowns.
///
/// A period: `begin`, then outputs, contacts and known forces in any order, then `solve`:
///
///   controller.begin(model);
///   controller.track_com(target);
///   controller.track_orientation(attitude);
///   controller.add_contact({left_front, force});
///   controller.track_point(right_front, swing);
///   const Eigen::VectorXd& torques = controller.solve().torques;
///
/// An arm adds `track_joint` or `track_point` for its hand, and the load's force on it by
/// `add_force` where it is known, or by a contact without friction where the QP is to choose it.
class WholeBodyController {
 public:
  /// Throws std::invalid_argument with the settings' `explain_invalid()`.
  WholeBodyController(const RobotModel& model, const WholeBodySettings& settings);

  /// Starts a period; `model` is updated with the state and outlives `solve`.
  void begin(const RobotModel& model);
  void track_com(const PointTarget& target);
  void track_orientation(const OrientationTarget& target);
  void track_point(int point, const PointTarget& target);
  void track_joint(int joint, double position, double position_des, double velocity_des);
  void add_contact(const Contact& contact);
  /// A known force on a point, world axes, N.
  void add_force(int point, const Vector3& force);

  /// Never throws. When the QP has no usable solution, the torques of the last good period are held
  /// for `hold_periods`; after that, or without any, they carry the desired forces and damp.
  const WholeBodyResult& solve();

  const WholeBodyResult& result() const { return now().result; }
  const DenseQp& qp() const { return now().qp; }  ///< the last one solved
  const Eigen::VectorXd& multipliers() const { return now().solver.multipliers(); }

 private:
  /// All that has another size for another number of contacts: one for each number, so that a gait
  /// allocates only where a number comes for the first time.
  struct Workspace {
    Eigen::MatrixXd response;   ///< D^-1 [S, J'], v' per unit of tau and f
    Eigen::MatrixXd phi;        ///< [Phi_tau, Phi_f] of (26)
    Eigen::VectorXd phi_error;  ///< Phi [tau; f] + phi_error = delta
    DenseQp qp;
    DenseQpSolver solver;
    WholeBodyResult result;
  };
  Workspace& now() { return workspaces_[now_]; }
  const Workspace& now() const { return workspaces_[now_]; }
  int add_outputs(int rows);
  void build();
  void build_contact_rows(Workspace& workspace) const;
  void build_limits(DenseQp& qp) const;
  void fall_back(Eigen::VectorXd& torques);

  WholeBodySettings settings_;
  const RobotModel* model_ = nullptr;
  Eigen::VectorXd bias_;     ///< H less the known forces
  Eigen::MatrixXd outputs_;  ///< Jacobian of y, one row an output
  Eigen::VectorXd demand_;   ///< y'' that is wanted, less its drift
  int rows_ = 0;             ///< of them in use
  std::vector<Contact> contacts_;
  Eigen::LLT<Eigen::MatrixXd> mass_;
  Eigen::VectorXd free_;  ///< v' for tau = f = 0
  std::vector<Workspace> workspaces_;
  std::size_t now_ = 0;  ///< which of them: the number of contacts
  Eigen::VectorXd last_good_;
  int periods_since_good_ = 0;
  bool has_good_ = false;
};

}  // namespace palanquin
