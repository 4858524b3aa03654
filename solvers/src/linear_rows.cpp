#include "linear_rows.hpp"

#include <algorithm>

namespace palanquin {
namespace {

template <typename Vector>
bool is_zero(const Vector& v, double tolerance) {
  return (v.array().abs() <= tolerance).all();
}

bool knot_satisfies_rows(const StageQp& qp, int k, const std::vector<Eigen::VectorXd>& w,
                         double tolerance, Eigen::VectorXd& buffer) {
  const QpStage& stage = qp.stages[k];
  const auto copy = [&buffer](const Eigen::VectorXd& value) {
    buffer.head(value.size()) = value;
    return buffer.head(value.size());
  };

  auto equality = copy(stage.equality_value);
  stage.equality_jacobian.multiply_add(w[k].data(), equality.data());
  if (!is_zero(equality, tolerance)) return false;

  auto link = copy(stage.link_value);
  if (k > 0) stage.link_previous.multiply_add(w[k - 1].data(), link.data());
  stage.link_jacobian.multiply_add(w[k].data(), link.data());
  if (!is_zero(link, tolerance)) return false;

  auto inequality = copy(stage.inequality_value);
  stage.inequality_jacobian.multiply_add(w[k].data(), inequality.data());
  if (!(inequality.array() <= tolerance).all()) return false;

  if (k == qp.horizon()) return true;
  auto defect = copy(stage.offset);
  stage.dynamics.multiply_add(w[k].data(), defect.data());
  stage.implicit.multiply_add(w[k + 1].data(), defect.data());
  defect -= w[k + 1].head(defect.size());
  return is_zero(defect, tolerance);
}

}  // namespace

bool satisfies_rows(const StageQp& qp, const std::vector<Eigen::VectorXd>& w, double tolerance,
                    Eigen::VectorXd& buffer) {
  Eigen::Index longest = 0;
  for (const QpStage& stage : qp.stages)
    longest = std::max({longest, stage.offset.size(), stage.equality_value.size(),
                        stage.inequality_value.size(), stage.link_value.size()});
  if (buffer.size() < longest) buffer.resize(longest);

  if (!is_zero(w[0].head(qp.stages[0].nx) - qp.initial_state, tolerance)) return false;
  for (int k = 0; k <= qp.horizon(); ++k)
    if (!knot_satisfies_rows(qp, k, w, tolerance, buffer)) return false;
  return true;
}

}  // namespace palanquin
