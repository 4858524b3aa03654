#pragma once

#include <array>
#include <string>
#include <vector>

#include "palanquin/core/lowered_function.hpp"

namespace palanquin {

/// What a block is at one knot. The first five are what a problem's role expressions evaluate to;
/// Fixed is found by the engine: carried from a value known before the horizon.
enum class Role : int { Input = 0, Carried = 1, Local = 2, Absent = 3, State = 4, Fixed = 5 };

/// A named group of variables of one knot.
struct BlockInfo {
  std::string name;
  bool is_quaternion = false;
  bool is_state = false;
  int size = 0;            ///< ambient
  int tangent_size = 0;    ///< 3 for a quaternion, else size
  int offset = 0;          ///< in the knot vector z
  int tangent_offset = 0;  ///< in a step dz
  int chart_size = 0;      ///< coordinates of its chart, 0 without one
  int slope_offset = 0;    ///< of its [size x chart_size] column-major slope in chart's 2nd result
};

/// Neighbouring blocks that move as one vector: entries `offset` on of the knot vector z by those
/// of `tangent_offset` on in a step dz.
struct VectorRun {
  int offset = 0;
  int tangent_offset = 0;
  int size = 0;
};

/// A named group of run-time parameters.
struct ParameterInfo {
  std::string name;
  int size = 0;
  int offset = 0;
};

enum class RowKind : int { Equality = 0, Inequality = 1, Link = 2 };
enum class StageKind : int { Running = 0, Terminal = 1 };

/// Rows that share a family, an owner and a policy.
struct RowGroup {
  std::string family;
  std::string robot;  ///< empty when nobody's
  std::string limb;
  int size = 0;
  int offset = 0;        ///< among the rows of its kind and stage
  bool implied = false;  ///< by a role or a chart: the reduced form holds it by construction
  double scale = 1.0;    ///< physical size of one unit of the row
};

/// A problem as it was lowered: what its blocks, parameters and rows are, and its functions.
///
/// Immutable and shared by any number of solvers and threads.
class LoweredProblem {
 public:
  /// Loads the library that `palanquin.lower` built. Throws std::runtime_error when it cannot be
  /// loaded or was lowered for another version of the manifest.
  explicit LoweredProblem(const std::string& path);

  const std::string& name() const { return name_; }
  const std::string& path() const { return library_.path(); }
  const std::vector<BlockInfo>& blocks() const { return blocks_; }
  /// Those blocks that are states.
  const std::vector<BlockInfo>& states() const { return states_; }
  /// All blocks that are no quaternions, and those that are.
  const std::vector<VectorRun>& vector_runs() const { return vector_runs_; }
  const std::vector<BlockInfo>& quaternions() const { return quaternions_; }
  const std::vector<ParameterInfo>& parameters() const { return parameters_; }
  const std::vector<RowGroup>& rows(StageKind stage, RowKind kind) const {
    return rows_[static_cast<std::size_t>(stage)][static_cast<std::size_t>(kind)];
  }
  /// Number of rows of a kind at a stage, all groups together.
  int row_count(StageKind stage, RowKind kind) const;
  /// Block of a name; throws std::invalid_argument that lists the blocks there are.
  const BlockInfo& block(const std::string& name) const;

  int nz() const { return nz_; }    ///< size of a knot vector z (ambient)
  int ndz() const { return ndz_; }  ///< size of a step dz (tangent)
  int nx() const { return nx_; }    ///< states' ambient size
  int ndx() const { return ndx_; }  ///< states' tangent size
  int np() const { return np_; }

  /// "friction (robot left, limb LF, row 2, knot 3)".
  std::string row_name(StageKind stage, RowKind kind, int row, int knot) const;
  /// "dynamics of payload.velocity[2] (knot 3)" for an ambient row of the next state.
  std::string dynamics_name(int row, int knot) const;

  // Functions; arguments and results as listed in palanquin/lowering/__init__.py.
  LoweredFunction structure, chart;
  LoweredFunction running, running_linear, terminal, terminal_linear, link, link_linear;
  /// running and terminal, and the two with derivatives, for the knots of a horizon: by StageKind.
  std::array<LaneFunction, 2> knot_values, knot_derivatives;

 private:
  void parse_manifest(const std::string& text);
  void add_block(BlockInfo block);

  LoweredLibrary library_;
  std::string name_;
  std::vector<BlockInfo> blocks_, states_, quaternions_;
  std::vector<VectorRun> vector_runs_;
  std::vector<ParameterInfo> parameters_;
  std::array<std::array<std::vector<RowGroup>, 3>, 2> rows_;
  int nz_ = 0, ndz_ = 0, nx_ = 0, ndx_ = 0, np_ = 0;
};

}  // namespace palanquin
