#pragma once

#include <array>
#include <cstdint>
#include <map>
#include <memory>
#include <utility>
#include <vector>

#include "elimination/substitution.hpp"
#include "palanquin/core/stage_qp.hpp"

namespace palanquin {

/// A StageQp without the inputs and locals that equality rows give (Substitution, knot by knot).
/// Rows over two knots that are folded into one are such rows where they define a variable, as
/// du - (u - previous(u)) = 0 does. Penalised and hard rows stay as many as they are. Nothing
/// allocates while the structure stays.
class EliminatedQp {
 public:
  /// Takes over `qp`, which must live, unchanged but for its initial state, as long as this is
  /// used. False when nothing is given; then there is nothing to use.
  bool take(const StageQp& qp);
  /// The initial state may change in between.
  void update_initial_state() { reduced_.initial_state = whole_->initial_state; }
  bool is_of(const StageQp& qp) const { return whole_ == &qp; }
  const StageQp& qp() const { return reduced_; }
  /// A model of the whole as one of qp(): its rows are J w = J T w' + J t.
  const PenaltyModel& reduce(const PenaltyModel& model);

  /// A point of the whole as one of qp(): a warm start.
  void restrict_to(const StageQpSolution& whole, StageQpSolution& reduced) const;
  /// Back, without the multipliers of the rows that went.
  void extend(const StageQpSolution& reduced, StageQpSolution& whole) const;
  /// Those, from stationarity. `whole` has all other multipliers.
  void find_multipliers(const PenaltyModel& model, StageQpSolution& whole);
  /// du_0/dx_0 [nu x nx] of all inputs, from that of those that stay.
  void extend_gain(const Eigen::MatrixXd& reduced, Eigen::Ref<Eigen::MatrixXd> gain) const;

 private:
  struct Knot {
    const Substitution* substitution = nullptr;  ///< null: nothing is given
    Substitution::Values values;
    std::vector<char> refused;    ///< rows whose pivots were too small
    std::array<int, 11> sizes{};  ///< of what was planned: a revision is the caller's word
  };
  /// By pattern and refused rows; patterns without an id by the knot, as negative numbers.
  using Key = std::pair<int, std::vector<char>>;
  struct Shared {
    Substitution substitution;
    int pattern = -1;  ///< of the reduced knot
  };
  static std::array<int, 11> sizes(const QpStage& stage);
  bool is_planned(const StageQp& qp) const;
  bool hold_pivots(const StageQp& qp);
  void plan(const StageQp& qp);
  const Shared& find(const QpStage& stage, std::size_t k);
  static void copy_values(const QpStage& stage, QpStage& reduced);

  const StageQp* whole_ = nullptr;
  StageQp reduced_;
  PenaltyModel model_;
  std::vector<Knot> knots_;
  std::map<Key, std::unique_ptr<Shared>> shared_;
  std::uint64_t revision_ = 0;
  bool has_given_ = false;
  Eigen::VectorXd gradient_, rows_;
};

}  // namespace palanquin
