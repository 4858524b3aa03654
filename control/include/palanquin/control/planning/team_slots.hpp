#pragma once

#include <array>
#include <vector>

#include "palanquin/control/planning/instant.hpp"
#include "palanquin/control/planning/wrench_observer.hpp"
#include "palanquin/core/lowered_problem.hpp"

namespace palanquin::planning {

/// Where a team's quantities stand in a problem's knot and parameter vectors: found by name once,
/// read and written by number.
class TeamSlots {
 public:
  /// Throws std::invalid_argument that names what the problem lacks.
  TeamSlots(const LoweredProblem& problem, const Team& team, const Terrain& terrain);

  /// Position, orientation, velocity and angular velocity of each body in a knot vector z.
  using Parts = std::array<int, 4>;
  std::vector<Parts> bodies;              ///< [R + 1]
  std::vector<int> feet, forces;          ///< [4 R]
  std::vector<std::array<int, 2>> hands;  ///< force and torque, [R]

  void read_bodies(const double* z, double* states) const;
  void write_bodies(const double* states, double* z) const;
  /// States and feet of a measurement, into a knot vector.
  void write_measured(const TeamState& state, double* z) const;

  /// References, footholds and contacts of an instant, into parameters [N + 1, np].
  void write_instant(const Instant& now, RowMatrix& parameters) const;
  /// What surrounds the feet of a guess [N + 1, nz], into parameters.
  void write_ground(const Terrain& terrain, const RowMatrix& guess, RowMatrix& parameters) const;
  bool has_ground() const { return !ground_.empty(); }
  /// Force and torque on each body [N + 1, 6 (R + 1)], world, N and N m.
  void write_wrenches(MatrixView wrenches, RowMatrix& parameters) const;
  /// Adds to the force and torque on a body, payload first, at one knot's parameters [np].
  void add_wrench(const Eigen::RowVectorXd& wrench, int body, Eigen::VectorXd& parameters) const;
  /// Mass and moments of a body, payload first, at the first knot.
  Inertial inertial(const RowMatrix& parameters, int body) const;
  /// Whether every plan, or set_ditches, writes the parameter at an offset.
  bool is_written(int offset) const;
  int spacing() const { return spacing_; }  ///< of "dt"
  /// Offset of "ditches", -1 if there are none, and how many there may be.
  int ditches() const { return ditches_; }
  int most_ditches() const { return most_ditches_; }

 private:
  std::vector<Parts> references_;                         ///< [R + 1]
  std::vector<int> footholds_, contacts_, previous_;      ///< [R]
  std::vector<std::array<int, 2>> external_;              ///< force and torque, [R + 1]
  std::vector<std::array<int, 2>> inertials_;             ///< mass and moments, [R + 1]
  std::vector<std::vector<std::pair<int, int>>> ground_;  ///< offset and size, [4 R][parameters]
  int ground_size_ = 0;
  int spacing_ = 0, ditches_ = -1, most_ditches_ = 0;
  mutable std::vector<double> values_;  ///< around one foothold
};

}  // namespace palanquin::planning
