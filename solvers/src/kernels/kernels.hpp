#pragma once

/// The dense and sparse-times-dense inner loops of the structured QP solver.
///
/// Matrices are column-major, start on a 64-byte boundary and have a leading dimension that is a
/// multiple of kPad, so that a kernel works on whole vectors and never looks at a remainder. Rows
/// between a matrix's own and the next multiple of kPad are read and written: they hold zeros on
/// entry and stay zero.
///
/// kernels.cpp is compiled once per processor level into a namespace of its own; `kernels_for`
/// (dispatch.cpp) hands out the table of the level asked for. A kernel does its floating-point
/// operations in an order that depends on the sizes alone: its results are the same bit for bit in
/// every run on one level.
namespace palanquin::kernels {

/// Doubles in a cache line, and the multiple to which rows are padded.
inline constexpr int kPad = 8;
constexpr int padded(int n) { return (n + kPad - 1) / kPad * kPad; }

/// Columns of a sparse matrix: column j has entries start[j] .. end[j] - 1.
struct SparseColumns {
  const int* start;
  const int* end;
  const int* row;
  const double* value;
};

/// Rows of a sparse matrix by runs. Run r holds the entries run_begin[r] .. run_begin[r + 1] - 1,
/// at most kPad of them, which stand in neighbouring slots; row i holds the runs run_start[i] ..
/// run_start[i + 1] - 1, slots ascending.
struct SparseRows {
  int count;
  const int* run_start;
  const int* run_begin;
  const int* slot;   ///< of an entry
  const int* entry;  ///< where an entry's value stands
};

/// A sparse matrix by runs: entries of one column in neighbouring rows, at most kPad of them, whose
/// values stand one after the other. Block b of runs block_start[b] .. block_start[b + 1] - 1 has
/// the rows block_row[b] .. block_row[b] + block_size[b] - 1. Entries in no run are singles.
/// kPad values may be read from the first one of a run.
struct SparseRuns {
  int blocks;
  const int* block_row;
  const int* block_size;
  const int* block_start;
  const int* run_column;
  const int* run_entry;  ///< where the first value stands
  int singles;
  const int* single_row;
  const int* single_column;
  const int* single_entry;
};

/// Variables (locals) that are eliminated together, and all slots that they meet, by runs as in
/// SparseRows: the locals' own runs first, then the others'.
struct LocalGroup {
  int locals;
  int runs;
  int local_runs;
  const int* run_slot;
  const int* run_size;
  const int* local_slot;  ///< [locals]
  const int* local_row;   ///< [locals], kPad times its run plus its place there
  int factor_offset;      ///< of the group's factor among those of all groups
  /// Doubles of the group's factor.
  int factor_size() const { return locals * (runs + 1) * kPad; }
};

struct Table {
  /// full = lower + lower' - diag(lower): [n x n], both sides of the diagonal filled.
  void (*symmetrize)(int n, const double* lower, int ld_lower, double* full, int ld_full);

  /// dst = (src S)' for the columns first .. first + count - 1 of S: dst is [count x rows] with
  /// zero rows up to padded(count). `rows` is a multiple of kPad.
  void (*multiply_transposed)(int rows, const SparseColumns& s, int first, int count,
                              const double* src, int ld_src, double* dst, int ld_dst);

  /// dst = src S for the columns first .. first + count - 1 of S, column j of dst only from row
  /// j / kPad * kPad on: the lower triangle and what is below it.
  void (*multiply_lower)(int rows, const SparseColumns& s, int first, int count, const double* src,
                         int ld_src, double* dst, int ld_dst);

  /// a := a (I - N)^{-1}, column by column in `order`: a_c += sum_r a_r N_rc, where the columns r
  /// that N's column c names come before c. Columns of N without entries are not in `order`.
  void (*substitute)(int rows, const SparseColumns& n, const int* order, int count, double* a,
                     int ld);

  /// Adds J'D J to a symmetric matrix, lower triangle, and J's to a gradient: rows J, weights D,
  /// slopes s. Element (i, j) of the matrix is column[j][i]. Zeros are added up to kPad places
  /// behind a run's first slot, and anything above the diagonal inside a run's own square.
  /// `scratch` holds kPad doubles for every run.
  void (*add_weighted_rows)(const SparseRows& rows, const double* values, const double* weight,
                            const double* slope, double* const* column, double* gradient,
                            double* scratch);

  /// Eliminates all groups' locals from the matrix whose element (i, j), i >= j, is column[j][i],
  /// and from the gradient: what is left of both has the Schur complement. The locals' columns are
  /// zero afterwards. Zeros are added around runs as by add_weighted_rows. Returns whether every
  /// pivot is above `tolerance` times its diagonal entry; if not, no complement was subtracted.
  bool (*eliminate_groups)(const LocalGroup* groups, int count, double tolerance,
                           double* const* column, double* gradient, double* factors);

  /// Back substitution with eliminate_groups' factors: the locals in z, which hold a right-hand
  /// side y, become -L^{-T} (y + L_B' z_B + constant * what was left of their gradient).
  void (*back_substitute_groups)(const LocalGroup* groups, int count, const double* factors,
                                 double constant, double* z);
  /// Forward substitution: g_A := L^{-1} g_A, g_B -= L_B g_A.
  void (*forward_substitute_groups)(const LocalGroup* groups, int count, const double* factors,
                                    double* g);

  /// y += a x with a [rows x cols], rows a multiple of kPad.
  void (*multiply_add)(int rows, int cols, const double* a, int ld, const double* x, double* y);

  /// y += S x. Zeros are added up to kPad places behind a block's first row.
  void (*multiply_runs_add)(const SparseRuns& s, const double* values, const double* x, double* y);

  /// Lists the rows i for which start_i or start_i + change_i is above limit_i, or NaN, and returns
  /// how many. Reads up to padded(count) entries.
  int (*list_rows_above)(int count, const double* limit, const double* start, const double* change,
                         int* above);

  /// y = [A B'] x for a symmetric A [cols x cols] of which `lower` holds the lower triangle with B
  /// below it, `rows` rows in all (padded). x and y have `rows` entries, y's behind `cols` are
  /// without meaning.
  void (*symmetric_multiply)(int rows, int cols, const double* lower, int ld, const double* x,
                             double* y);

  /// The first `pivots` columns of the symmetric matrix
  ///     [ A  B' ]  panel = [A; B], rows of A padded to padded(pivots) by zeros,
  ///     [ B  C  ]  c = lower triangle of C with `rows` rows (padded) and `cols` columns
  /// are eliminated: panel := [L; B L^{-T}], A = L L', and C := C - B A^{-1} B'. The panel's
  /// diagonal receives 1 / L_kk; its columns pivots .. padded(pivots) - 1 hold unit vectors.
  /// Returns the first pivot that is not above `tolerance` times the diagonal entry of A (NaN
  /// included), or -1 if there is none.
  int (*partial_cholesky)(int pivots, int rows, int cols, double tolerance, double* panel,
                          int ld_panel, double* c, int ld_c);

  /// Back substitution with a panel of partial_cholesky: z := -L^{-T} (z_A + L_B' z_B) in the first
  /// `pivots` entries of z, which has padded(pivots) + rows entries, zeros in the padding.
  void (*back_substitute)(int pivots, int rows, const double* panel, int ld_panel, double* z);

  /// Forward substitution: g_A := L^{-1} g_A and g_B -= L_B g_A.
  void (*forward_substitute)(int pivots, int rows, const double* panel, int ld_panel, double* g);
};

}  // namespace palanquin::kernels
