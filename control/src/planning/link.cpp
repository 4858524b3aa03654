#include "palanquin/control/planning/link.hpp"

#include <algorithm>
#include <stdexcept>

#include "palanquin/control/planning/rotations.hpp"

namespace palanquin::planning {

namespace {
/// Rows `steps` on; the last one is held.
RowMatrix later_rows(const RowMatrix& rows, int steps) {
  RowMatrix later(rows.rows(), rows.cols());
  for (Eigen::Index k = 0; k < rows.rows(); ++k)
    later.row(k) = rows.row(std::min<Eigen::Index>(k + steps, rows.rows() - 1));
  return later;
}
}  // namespace

RowMatrix Message::aged_bar(int bar, int steps) const {
  return later_rows(bars[static_cast<std::size_t>(bar)], steps);
}

Message Message::aged(int steps) const {
  if (steps == 0) return *this;
  Message later = *this;
  later.states = later_rows(states, steps);
  const auto turned = [&](Eigen::Index k) {
    return Matrix3(operating * rotation_exp(later.states.row(k).segment<3>(6).transpose()));
  };
  later.operating = turned(0);
  for (Eigen::Index k = later.states.rows() - 1; k >= 0; --k)
    later.states.row(k).segment<3>(6) =
        rotation_log(later.operating.transpose() * turned(k)).transpose();
  later.inputs = later_rows(inputs, steps);
  if (!is_held) later.inputs.bottomRows(std::min<Eigen::Index>(steps, inputs.rows())).setZero();
  for (RowMatrix& bar : later.bars)
    if (bar.size() > 0) bar = later_rows(bar, steps);
  later.dual = later_rows(dual, steps);
  return later;
}

void Link::send(Message message) {
  const bool is_first = !heard_ && sent_.empty();
  if (is_first || std::uniform_real_distribution<double>()(random_) >= settings_.loss)
    sent_.push_back(std::move(message));
}

Message Link::receive(int step) {
  const auto has_arrived = [&](const Message& m) {
    return m.step + (m.is_held ? 0 : settings_.delay) <= step;
  };
  while (!sent_.empty() && has_arrived(sent_.front())) {
    heard_ = std::move(sent_.front());
    sent_.pop_front();
  }
  if (!heard_) throw std::logic_error("a link begins with a greeting");
  return heard_->aged(step - heard_->step);
}

}  // namespace palanquin::planning
