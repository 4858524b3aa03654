#pragma once

#include <array>
#include <map>
#include <string>
#include <vector>

#include "palanquin/core/lowered_function.hpp"
#include "palanquin/core/manifest.hpp"

namespace palanquin {

/// What a block is at one knot. The first five are what a problem's role expressions evaluate to;
/// Fixed is found by the engine: carried from a value known before the horizon.
enum class Role : int { Input = 0, Carried = 1, Local = 2, Absent = 3, State = 4, Fixed = 5 };

/// Neighbouring blocks that move as one vector: entries `offset` on of the knot vector z by those
/// of `tangent_offset` on in a step dz.
struct VectorRun {
  int offset = 0;
  int tangent_offset = 0;
  int size = 0;
};

/// A problem as it was lowered: what its blocks, parameters and rows are, its functions, and the
/// horizon, defaults and policies that were stated with it.
///
/// Immutable and shared by any number of solvers and threads.
class LoweredProblem {
 public:
  /// Loads a folder that `palanquin.Lowered.save` wrote; or a library in the cache, with what its
  /// problem stated when it was lowered last. Throws std::runtime_error that says why it cannot be
  /// loaded: files that are missing or damaged, or made for another processor or version.
  explicit LoweredProblem(const std::string& path);
  /// The library at `library` with the statements of `manifest` (text, see Manifest). Throws as
  /// above, and when the library was made of another problem.
  LoweredProblem(const std::string& library, const std::string& manifest);

  const std::string& name() const { return manifest_.name; }
  /// The library's path.
  const std::string& path() const { return library_.path(); }
  const Manifest& manifest() const { return manifest_; }
  /// Number of intervals that was stated with the problem; solvers may take another.
  int horizon() const { return manifest_.horizon; }
  /// Policy of each inequality family, with which a solver begins.
  const std::map<std::string, Policy>& policies() const { return manifest_.policies; }
  const std::vector<BlockInfo>& blocks() const { return manifest_.blocks; }
  /// Those blocks that are states.
  const std::vector<BlockInfo>& states() const { return states_; }
  /// All blocks that are no quaternions, and those that are.
  const std::vector<VectorRun>& vector_runs() const { return vector_runs_; }
  const std::vector<BlockInfo>& quaternions() const { return quaternions_; }
  const std::vector<ParameterInfo>& parameters() const { return manifest_.parameters; }
  const std::vector<RowGroup>& rows(StageKind stage, RowKind kind) const {
    return manifest_.rows[static_cast<std::size_t>(stage)][static_cast<std::size_t>(kind)];
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
  LoweredProblem(const std::string& path, LoweredLibrary library);
  LoweredProblem(LoweredLibrary library, Manifest manifest);
  void add_block(const BlockInfo& block);

  LoweredLibrary library_;
  Manifest manifest_;
  std::vector<BlockInfo> states_, quaternions_;
  std::vector<VectorRun> vector_runs_;
  int nz_ = 0, ndz_ = 0, nx_ = 0, ndx_ = 0, np_ = 0;
};

}  // namespace palanquin
