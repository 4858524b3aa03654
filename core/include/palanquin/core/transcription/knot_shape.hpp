#pragma once

#include <array>
#include <compare>
#include <map>
#include <memory>
#include <vector>

#include "palanquin/core/gather.hpp"
#include "palanquin/core/lowered_problem.hpp"
#include "palanquin/core/sparse_block.hpp"
#include "palanquin/core/stage_qp.hpp"
#include "palanquin/core/transcription/exact_hessian.hpp"

namespace palanquin {

/// How rows over two knots enter the QP.
enum class LinkRows {
  Linked,  ///< as such
  Folded,  ///< as rows of the later knot, whose state holds what they need of the earlier one
};

/// What the run-time flags make of one knot: a role and a chart flag per block, an active flag per
/// row group. Equal signatures of a knot and its neighbours mean equal patterns.
struct KnotSignature {
  StageKind stage = StageKind::Running;
  std::vector<Role> role;                   ///< [blocks]
  std::vector<char> charted;                ///< [blocks]
  std::array<std::vector<char>, 3> active;  ///< per RowKind, [groups]
  std::vector<char> is_hard;                ///< policies of the inequality groups
  /// Whether its states are given and rows are hard: those over states alone ask nothing.
  bool is_measured = false;
  auto operator<=>(const KnotSignature&) const = default;
};

/// The reduced variables of one knot: dz = T(slopes) w, T stored by columns of dz.
class ColumnMap {
 public:
  struct Entry {
    int column;  ///< in w
    int slope;   ///< index among the chart's slopes, negative: 1
  };

  ColumnMap() = default;
  /// `memory`: coordinates of the knot before that this knot's state holds besides, as columns of
  /// a map of that knot without memory.
  ColumnMap(const LoweredProblem& problem, const KnotSignature& signature,
            std::vector<int> memory = {});

  int nx = 0, nu = 0, nl = 0;
  int nw() const { return nx + nu + nl; }
  const Entry* begin(int tangent_column) const { return &entries_[start_[tangent_column]]; }
  const Entry* end(int tangent_column) const {
    return entries_.data() + start_[tangent_column + 1];
  }
  /// First column of block `b` in w, negative when it has none.
  int first_column(int b) const { return first_column_[static_cast<std::size_t>(b)]; }
  /// Number of columns of block `b` in w.
  int column_count(int b) const { return column_count_[static_cast<std::size_t>(b)]; }
  /// The memory's columns are the last ones of x; steps dz do not see them.
  const std::vector<int>& memory() const { return memory_; }
  int first_memory() const { return nx - static_cast<int>(memory_.size()); }
  /// Where a column of this knot's map without memory is.
  int with_memory(int column) const {
    return column < first_memory() ? column : column + static_cast<int>(memory_.size());
  }

  /// dz = T w
  void expand(const double* w, const double* slopes, double* dz) const {
    expansion_.write(w, slopes, dz);
  }

 private:
  Gather expansion_;
  std::vector<std::size_t> start_;
  std::vector<Entry> entries_;
  std::vector<int> first_column_, column_count_, memory_;
};

/// Of the inequality rows at the first knot: whether a row looks at states that were measured, not
/// free, and at nothing else. Such a row asks nothing of a plan.
std::vector<char> over_measured_states(const LoweredProblem& problem, const KnotSignature& first);

/// The lowered rows that one knot has.
struct KnotRows {
  KnotRows() = default;
  /// `is_linked`: whether link rows are rows over two knots, and not equality rows of this one.
  KnotRows(const LoweredProblem& problem, const KnotSignature& signature, bool is_linked);

  StageKind stage = StageKind::Running;
  std::vector<int> equality_rows;
  std::vector<int> own_links;  ///< link rows stated as equality rows, behind the stage's own
  std::vector<int> penalty_rows;
  std::vector<int> inequality_rows;  ///< hard ones
  std::vector<int> measured_rows;    ///< hard ones over given states alone, which no plan changes
  std::vector<int> link_rows;
};

/// Everything about one knot that depends on roles and flags alone: its rows, its reduced patterns,
/// and how their values are gathered from the lowered functions' results. Made once per distinct
/// combination of flags and then looked up.
struct KnotShape : KnotRows {
  KnotSignature signature;
  ColumnMap columns;
  QpStage pattern;  ///< dimensions, patterns and their id, values zero

  /// Entries of one block in the knot vector.
  struct Entries {
    int offset;
    int size;
  };
  std::vector<Entries> held;     ///< fixed and carried blocks: copies of the knot before
  std::vector<Entries> absent;   ///< zero
  std::vector<Entries> charted;  ///< free on their charts
  /// Slopes of carried blocks, by which they depend on the coordinates of where their chain began.
  std::vector<Entries> held_slopes;

  std::vector<int>
      local_dynamics;  ///< entries of the dynamics' Jacobian that must be zero: locals'

  Gather dynamics, implicit, hessian, exact_hessian, gradient;
  Gather equality, penalty, inequality;
  Gather own_link, remembered_link;  ///< of own_links: their columns of this knot, of its memory
  Gather link_previous, link;
};

/// Makes and keeps the shapes that a problem has met.
class ShapeTable {
 public:
  /// With `exact`, Hessians get a dense pattern, and a recipe for exact values besides.
  ShapeTable(const LoweredProblem& problem, const ExactHessian* exact, LinkRows links)
      : problem_(&problem), exact_(exact), links_(links) {}

  /// The shape of a knot between its neighbours (null at the ends of the horizon), of which equal
  /// ones have one address. Allocates only when the combination is new.
  const KnotShape& find(const KnotSignature* previous, const KnotSignature* knot,
                        const KnotSignature* next);
  std::size_t size() const { return shapes_.size(); }
  /// Forgets all shapes; addresses that were given out are void.
  void clear() { shapes_.clear(); }

 private:
  std::unique_ptr<KnotShape> make(const KnotSignature* previous, const KnotSignature& knot,
                                  const KnotSignature* next) const;
  ColumnMap columns(const KnotSignature* previous, const KnotSignature& knot) const;

  const LoweredProblem* problem_;
  const ExactHessian* exact_;
  LinkRows links_;
  std::map<std::array<const KnotSignature*, 3>, std::unique_ptr<KnotShape>> shapes_;
};

}  // namespace palanquin
