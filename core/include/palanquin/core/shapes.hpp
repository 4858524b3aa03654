#pragma once

#include <Eigen/Core>
#include <stdexcept>
#include <string>

namespace palanquin {

/// Throws std::invalid_argument that begins with `what` ("trajectory has") and gives both shapes
/// unless `array` is [rows, cols].
template <class Derived>
void check_shape(const std::string& what, const Eigen::DenseBase<Derived>& array, Eigen::Index rows,
                 Eigen::Index cols) {
  const auto shape = [](Eigen::Index r, Eigen::Index c) {
    return "[" + std::to_string(r) + ", " + std::to_string(c) + "]";
  };
  if (array.rows() != rows || array.cols() != cols)
    throw std::invalid_argument(what + " shape " + shape(array.rows(), array.cols()) + "; " +
                                shape(rows, cols) + " is needed");
}

}  // namespace palanquin
