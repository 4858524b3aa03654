#pragma once

#include <array>
#include <map>
#include <string>
#include <vector>

#include "palanquin/core/penalty.hpp"

namespace palanquin {

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

/// A named group of run-time parameters.
struct ParameterInfo {
  std::string name;
  std::vector<int> shape;        ///< [n], or rows and columns of a row-major matrix
  std::vector<double> defaults;  ///< [size]
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

/// What the engine must know of a lowered problem besides its functions: lines of words, the first
/// of each line saying what it states (written by palanquin/lowering/manifest_lines.py):
///
///   palanquin VERSION                  before all others
///   content HASH                       of the statement that the functions were made of
///   name NAME
///   block NAME real|quaternion SIZE state|variable CHART_COORDINATES
///   parameter NAME SIZE  or  NAME ROWS COLUMNS
///   rows running|terminal equality|inequality|link FAMILY ROBOT|- LIMB|- SIZE IMPLIED SCALE
///   horizon N
///   default PARAMETER VALUE...
///   policy FAMILY hard|c2_penalty|squared_hinge|relaxed_barrier STIFFNESS SMOOTHING
///
/// The last three change without lowering: a library of functions serves any of them.
struct Manifest {
  std::string content;
  std::string name;
  int horizon = 0;
  std::vector<BlockInfo> blocks;
  std::vector<ParameterInfo> parameters;
  /// By StageKind and RowKind.
  std::array<std::array<std::vector<RowGroup>, 3>, 2> rows;
  std::map<std::string, Policy> policies;  ///< by inequality family
  /// All lines but those that change without lowering: equal for a library and what it belongs to.
  std::string structure;
};

/// Reads a manifest, independently of locales. Throws std::runtime_error that names `source`, line
/// and rule for text of another version, malformed or repeated lines, and statements that are
/// missing or contradict each other.
Manifest parse_manifest(const std::string& text, const std::string& source);

}  // namespace palanquin
