#include "palanquin/control/planning/foothold_starts.hpp"

#include <algorithm>
#include <numeric>

namespace palanquin::planning {

CheapestCombinations::CheapestCombinations(int combinations, int lists)
    : lists_(static_cast<std::size_t>(lists)),
      width_(static_cast<std::size_t>(lists)),
      most_(combinations * lists + 1) {
  heap_.reserve(static_cast<std::size_t>(most_));
  ranks_.resize(static_cast<std::size_t>(most_) * width_);
  picked_.resize(width_ + 1);
}

void CheapestCombinations::clear() { count_ = 0; }

void CheapestCombinations::add(const double* costs, int count) {
  List& list = lists_[count_++];
  list.count = count;
  const auto order = list.order.begin();
  std::iota(order, order + count, std::uint8_t{0});
  std::sort(order, order + count, [costs](std::uint8_t a, std::uint8_t b) {
    return costs[a] != costs[b] ? costs[a] < costs[b] : a < b;
  });
  for (int i = 0; i < count; ++i) list.steps[i] = costs[list.order[i]] - costs[list.order[0]];
}

void CheapestCombinations::begin() {
  heap_.clear();
  std::fill_n(ranks_.begin(), count_, std::uint8_t{0});
  heap_.push_back({0.0, 0, 0});
  born_ = 1;
}

/// Between equal totals the lower ranks come first, list by list.
bool CheapestCombinations::is_dearer(const Node& a, const Node& b) const {
  if (a.total != b.total) return a.total > b.total;
  const std::uint8_t *ra = ranks(a.number), *rb = ranks(b.number);
  return std::lexicographical_compare(rb, rb + count_, ra, ra + count_);
}

const std::uint8_t* CheapestCombinations::next() {
  if (heap_.empty()) return nullptr;
  const auto dearer = [this](const Node& a, const Node& b) { return is_dearer(a, b); };
  std::pop_heap(heap_.begin(), heap_.end(), dearer);
  const Node node = heap_.back();
  heap_.pop_back();
  for (std::size_t i = 0; i < count_; ++i) picked_[i] = lists_[i].order[ranks(node.number)[i]];
  for (std::size_t i = static_cast<std::size_t>(node.first); i < count_; ++i) {
    const int rank = ranks(node.number)[i];
    if (rank + 1 >= lists_[i].count || born_ == most_) continue;
    const double more = lists_[i].steps[rank + 1] - lists_[i].steps[rank];
    std::copy_n(ranks(node.number), count_, ranks(born_));
    ++ranks(born_)[i];
    heap_.push_back({node.total + more, born_++, static_cast<int>(i)});
    std::push_heap(heap_.begin(), heap_.end(), dearer);
  }
  return picked_.data();
}

namespace {
/// Most touchdowns in a horizon: a foot may land at every other knot.
int most_landings(int horizon, int feet) { return feet * (horizon / 2 + 1); }
}  // namespace

FootholdStarts::FootholdStarts(int at_most, int horizon, int feet)
    : combinations_(at_most, most_landings(horizon, feet)) {
  touchdowns_.reserve(static_cast<std::size_t>(most_landings(horizon, feet)));
}

int FootholdStarts::make(const RowMatrix& wanted, const Instant& now, const StandingGround& ground,
                         std::vector<RowMatrix>& starts) {
  touchdowns_.clear();
  combinations_.clear();
  for (Eigen::Index k = 0; k < now.contacts.rows(); ++k)
    for (int i = 0; i < now.contacts.cols(); ++i) {
      if (!now.is_landing(k, i)) continue;
      touchdowns_.push_back({k, i, ground.options(point(wanted, k, i))});
      const Choices& choices = touchdowns_.back().choices;
      std::array<double, Choices::kMost> costs{};
      for (int c = 0; c < choices.count; ++c)
        costs[c] = (choices.points[c] - point(wanted, k, i)).squaredNorm();
      combinations_.add(costs.data(), choices.count);
    }
  combinations_.begin();
  int count = 0;
  for (RowMatrix& start : starts) {
    const std::uint8_t* picked = combinations_.next();
    if (picked == nullptr) break;
    start = wanted;
    for (std::size_t t = 0; t < touchdowns_.size(); ++t)
      point(start, touchdowns_[t].knot, touchdowns_[t].foot) =
          touchdowns_[t].choices.points[picked[t]];
    ++count;
  }
  return count;
}

}  // namespace palanquin::planning
