#pragma once

#include <Eigen/Cholesky>
#include <Eigen/Core>

namespace palanquin {

/// The factors of Goldfarb and Idnani's active set: for H = L L' and the active rows' normals N
/// [n, q], an orthogonal Q with
///
///   J = L^-T Q,   J'N = [R; 0],   R upper triangular,   hence J'HJ = I,
///
/// J = [J1, J2] with q and n - q columns. J is formed from L when the first row comes in: a problem
/// without active rows pays for the Cholesky factorisation alone.
class DenseQpFactors {
 public:
  void resize(Eigen::Index n);
  /// Factorises H + diag(proximal), of which the lower triangle is read, with no active row. False
  /// unless every pivot is well above the rounding of its diagonal entry.
  bool factorize(const Eigen::MatrixXd& H, const Eigen::VectorXd& proximal);

  Eigen::Index active() const { return q_; }
  auto free_columns() const { return J_.rightCols(J_.cols() - q_); }  ///< J2
  auto active_columns() const { return J_.leftCols(q_); }             ///< J1
  auto triangle() const { return R_.topLeftCorner(q_, q_).triangularView<Eigen::Upper>(); }
  auto transposed_triangle() const {
    return R_.topLeftCorner(q_, q_).transpose().triangularView<Eigen::Lower>();
  }

  /// -H^-1 g, [n]
  void minimise(const Eigen::VectorXd& g, Eigen::VectorXd& x) const;
  /// d = J'a, [n]
  void project(const Eigen::VectorXd& a, Eigen::VectorXd& d);
  /// Adds the row with d = J'a and z = J2 d2 to the active ones, as the last.
  void append(const Eigen::VectorXd& d, const Eigen::VectorXd& z);
  /// Takes the row at a position out.
  void drop(Eigen::Index position);

 private:
  void form();

  Eigen::LLT<Eigen::MatrixXd> cholesky_;
  Eigen::MatrixXd J_, R_, shifted_;
  Eigen::VectorXd row_, reflector_;
  Eigen::Index q_ = 0;
  bool is_formed_ = false;
};

}  // namespace palanquin
