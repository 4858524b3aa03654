#pragma once

#include <array>
#include <cstdint>
#include <vector>

#include "palanquin/control/planning/instant.hpp"
#include "palanquin/control/planning/standing_ground.hpp"

namespace palanquin::planning {

/// Combinations of one choice out of each of several lists, in the order of the sum of what they
/// cost. They grow from the cheapest one as a tree: each raises, in its own sorted order, one
/// position at or after the one that its parent raised, so none comes twice.
class CheapestCombinations {
 public:
  /// For at most `combinations` of choices out of `lists` lists; allocates here only.
  CheapestCombinations(int combinations, int lists);
  /// Begins anew, with no list.
  void clear();
  /// Adds a list of costs, 1 to Choices::kMost of them.
  void add(const double* costs, int count);
  /// Starts with the cheapest combination.
  void begin();
  /// The next combination, as one index into each list; null when there is none.
  const std::uint8_t* next();

 private:
  struct List {
    std::array<std::uint8_t, Choices::kMost> order{};  ///< by cost
    std::array<double, Choices::kMost> steps{};        ///< sorted costs less the least
    int count = 0;
  };
  struct Node {
    double total;
    int number;  ///< in order of birth
    int first;   ///< list that was raised last
  };
  bool is_dearer(const Node& a, const Node& b) const;
  const std::uint8_t* ranks(int number) const { return ranks_.data() + number * width_; }
  std::uint8_t* ranks(int number) { return ranks_.data() + number * width_; }

  std::vector<List> lists_;
  std::size_t count_ = 0, width_;
  int most_;  ///< combinations that can be born
  std::vector<Node> heap_;
  std::vector<std::uint8_t> ranks_, picked_;
  int born_ = 0;
};

/// Starting points that differ in where feet land: choices that no gradient makes. Each start takes
/// every landing foot to one of the ground's options; they come in the order of the sum of squared
/// distances from the wanted footholds.
class FootholdStarts {
 public:
  FootholdStarts(int at_most, int horizon, int feet);
  /// Writes starts [N + 1, 12 R] made of `wanted` and returns how many, at most starts.size().
  int make(const RowMatrix& wanted, const Instant& now, const StandingGround& ground,
           std::vector<RowMatrix>& starts);

 private:
  struct Touchdown {
    Eigen::Index knot = 0;
    int foot = 0;
    Choices choices;
  };
  CheapestCombinations combinations_;
  std::vector<Touchdown> touchdowns_;
};

}  // namespace palanquin::planning
