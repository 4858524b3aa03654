#pragma once

#include <Eigen/Cholesky>
#include <Eigen/Core>
#include <string>
#include <vector>

#include "palanquin/control/whole_body/contact.hpp"
#include "palanquin/control/whole_body/robot_model.hpp"
#include "palanquin/control/whole_body/task_targets.hpp"
#include "palanquin/solvers/dense_qp.hpp"

namespace palanquin {

/// Of a task: y'' = y''_des - kp (y - y_des) - kd (y' - y'_des) + delta, delta costing
/// weight / 2 |delta|^2.
struct TaskSettings {
  double kp;            ///< 1/s^2
  double kd;            ///< 1/s
  double weight = 1e6;  ///< of delta in its unit, (m/s^2)^-2 or (rad/s^2)^-2
};

struct WholeBodySettings {
  double torque_weight = 1e2;  ///< of joint torques, (N m)^-2
  double force_weight = 1e4;   ///< of deviations from desired forces, N^-2
  double moment_weight = 1e4;  ///< the same of decided moments, (N m)^-2
  TaskSettings com{100, 20};
  TaskSettings orientation{400, 40};  ///< of the base
  TaskSettings foot{900, 60};
  TaskSettings hand{100, 20};
  TaskSettings limb_orientation{100, 20};
  TaskSettings joint{100, 20, 1e4};
  double contact_damping = 20;  ///< standing limbs: J v' + drift = -damping * velocity, 1/s
  double largest_force = 600;   ///< of a contact along its normal, N
  int hold_periods = 20;        ///< for which torques are held when the QP fails

  /// What is wrong with it, in words; empty if nothing.
  std::string explain_invalid() const;
};

struct WholeBodyResult {
  Status status = Status::NotSolved;
  bool is_fallback = false;  ///< the torques are not this period's QP's
  Eigen::VectorXd torques;   ///< [n], N m, always finite and within the limits
  Eigen::Matrix3Xd forces;   ///< [3, limbs] of contacts and decided wrenches, world axes, N; else 0
  Eigen::Matrix3Xd moments;  ///< [3, limbs] decided, world axes, N m; else 0
  int active_rows_changed = 0;
};

/// The whole-body QP of one robot and one period, after (25)-(28) of Kim et al. ("Layered control
/// for cooperative locomotion of two quadrupedal robots"), with a weight for each task, contacts on
/// ground of any slope and wrenches on hands:
///
///   min  g_tau/2 |tau|^2 + g_f/2 |f - f_des|^2 + g_m/2 |m - m_des|^2 + sum w_i/2 |delta_i|^2
///   s.t. y_i'' = y_i''_des - kp e - kd e' + delta_i   tasks, by input-output linearisation (26)
///        r'' = -damping r'                            of the limbs in contact (27)
///        |tau| <= limit,  f in its friction pyramid,  least <= f_n <= largest
///
/// over tau, the contacts' forces f, and the wrenches (f, m) of hands that are to be decided. The
/// accelerations come from the dynamics, v' = D^-1 ([0; tau] + sum (J'f + J_w'm) - H), and delta
/// from the tasks, so that only tau, f and m are left as unknowns.
///
/// A period: `begin`, then tasks, contacts and wrenches in any order, then `solve`:
///
///   controller.begin(model);
///   controller.track_com(target);
///   controller.track_orientation(attitude);
///   controller.add_contact({left_front, force});
///   controller.track_limb(right_front, swing);
///   controller.track_limb(hand, grip);
///   controller.add_wrench(hand, load);  // known; or decide_wrench, for the QP to choose it
///   const Eigen::VectorXd& torques = controller.solve().torques;
///
/// Nothing allocates after construction, whichever limbs are in contact.
class WholeBodyController {
 public:
  /// Throws std::invalid_argument with the settings' `explain_invalid()`.
  WholeBodyController(const RobotModel& model, const WholeBodySettings& settings);

  /// Starts a period; `model` is updated with the state, has the limbs and joints of the one it was
  /// constructed for, and outlives `solve`.
  void begin(const RobotModel& model);
  void track_com(const PointTarget& target);
  void track_orientation(const OrientationTarget& target);  ///< of the base
  void track_limb(int limb, const PointTarget& target);
  void track_limb_orientation(int limb, const OrientationTarget& target);
  void track_joint(int joint, const JointTarget& target);
  /// Throws std::invalid_argument for a limb that is in contact already, or whose wrench is to be
  /// decided, a negative friction, or a least force over the largest.
  void add_contact(const Contact& contact);
  /// A known wrench on a limb.
  void add_wrench(int limb, const Wrench& wrench);
  /// A wrench on a hand that the QP chooses, close to the desired one; without `has_moment` only
  /// its force, and the hand's moment is 0. Throws std::invalid_argument for a foot, or a limb in
  /// contact.
  void decide_wrench(int hand, const Wrench& desired, bool has_moment);

  /// Never throws. When the QP has no usable solution, the torques of the last good period are held
  /// for `hold_periods`; after that, or without any, they carry the desired forces and damp.
  const WholeBodyResult& solve();
  /// A period of which nothing is known, in place of `begin` to `solve`: as if the QP had failed.
  const WholeBodyResult& hold();

  const WholeBodyResult& result() const { return result_; }
  /// delta of the last period's tasks, in their order; 0 in a fallback.
  Eigen::Ref<const Eigen::VectorXd> slack() const { return slack_.head(rows_); }
  const DenseQp& qp() const { return now().qp; }  ///< the last one solved
  const Eigen::VectorXd& multipliers() const { return now().solver.multipliers(); }

 private:
  struct Decided {
    int limb = 0;
    Wrench desired;
    bool has_moment = false;
  };
  /// All that has another size for another number of contacts and of decided vectors.
  struct Workspace {
    Eigen::MatrixXd response;  ///< D^-1 [S, J'], v' per unit of tau, f and m
    Eigen::MatrixXd phi;       ///< [most rows, unknowns]: weighted tasks' y'' per unknown
    DenseQp qp;
    DenseQpSolver solver;
  };
  Workspace& now() { return workspaces_[now_]; }
  const Workspace& now() const { return workspaces_[now_]; }
  std::size_t workspace_of(std::size_t contacts, std::size_t vectors) const;
  void make_workspaces();
  int add_task(int rows, const TaskSettings& task);
  template <class Jacobian>
  void set_task(int row, const TaskSettings& task, const Jacobian& jacobian, const Vector3& demand);
  void require_free(int limb) const;
  void build();
  void build_response(Workspace& workspace);
  void build_cost(Workspace& workspace);
  void build_contacts(Workspace& workspace) const;
  void build_limits(DenseQp& qp) const;
  void read_solution();
  void fall_back();

  WholeBodySettings settings_;
  const RobotModel* model_ = nullptr;
  int limbs_, hands_;
  Eigen::VectorXd bias_;   ///< H less the known wrenches
  Eigen::MatrixXd tasks_;  ///< Jacobian of y, a row times the square root of its weight
  Eigen::VectorXd demand_, root_weight_;  ///< y'' that is wanted less its drift, likewise weighted
  int rows_ = 0;                          ///< of them in use
  std::vector<Contact> contacts_;
  std::vector<Decided> decided_;
  Eigen::Index vectors_ = 0;  ///< decided forces and moments
  Eigen::LLT<Eigen::MatrixXd> mass_;
  Eigen::VectorXd free_;   ///< v' for tau = f = m = 0
  Eigen::VectorXd error_;  ///< phi [tau; f; m] + error = weighted delta
  std::vector<Workspace> workspaces_;
  std::size_t now_ = 0;
  WholeBodyResult result_;
  Eigen::VectorXd slack_;
  Eigen::VectorXd last_good_;
  int periods_since_good_ = 0;
  bool has_good_ = false;
};

}  // namespace palanquin
