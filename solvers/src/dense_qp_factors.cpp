#include "palanquin/solvers/dense_qp_factors.hpp"

#include <Eigen/Jacobi>
#include <cmath>

namespace palanquin {

namespace {

/// Share of a diagonal entry that its pivot keeps at least. Rounding leaves some 1e-15 where the
/// exact pivot is 0; from 1e-10 on, dependent rows can be told from others (dense_qp.cpp).
constexpr double kSmallestPivot = 1e-10;

}  // namespace

void DenseQpFactors::resize(Eigen::Index n) {
  J_.resize(n, n);
  R_.resize(n, n);
  row_.resize(n);
  reflector_.resize(n);
  q_ = 0;
  is_formed_ = false;
}

bool DenseQpFactors::factorize(const Eigen::MatrixXd& H, const Eigen::VectorXd& proximal) {
  q_ = 0;
  is_formed_ = false;
  shifted_ = H;
  shifted_.diagonal() += proximal;
  cholesky_.compute(shifted_);
  return cholesky_.info() == Eigen::Success && (cholesky_.matrixLLT().diagonal().array().square() >
                                                kSmallestPivot * shifted_.diagonal().array())
                                                   .all();
}

void DenseQpFactors::minimise(const Eigen::VectorXd& g, Eigen::VectorXd& x) const {
  x = -g;
  cholesky_.solveInPlace(x);
}

/// J = L^-T, by bordering: with U = L', column j of its inverse is -U^-1[:j, :j] U[:j, j] / U[j,
/// j].
void DenseQpFactors::form() {
  const Eigen::MatrixXd& L = cholesky_.matrixLLT();
  J_.setZero();
  for (Eigen::Index j = 0; j < J_.cols(); ++j) {
    const double inverse = 1 / L(j, j);
    row_.head(j) = -inverse * L.row(j).head(j).transpose();
    J_.col(j).head(j).noalias() =
        J_.topLeftCorner(j, j).triangularView<Eigen::Upper>() * row_.head(j);
    J_(j, j) = inverse;
  }
  is_formed_ = true;
}

void DenseQpFactors::project(const Eigen::VectorXd& a, Eigen::VectorXd& d) {
  if (!is_formed_) form();
  d.noalias() = J_.transpose() * a;
}

/// Reflects J's free columns so that d becomes (d_1 .. d_q, -+|d2|, 0 .. 0): with v = d2 +- |d2| e1
/// and J2 d2 = z known, J2 (I - 2 v v' / v'v) is a rank-one change.
void DenseQpFactors::append(const Eigen::VectorXd& d, const Eigen::VectorXd& z) {
  const Eigen::Index rest = J_.cols() - q_;
  auto v = reflector_.head(rest);
  v = d.tail(rest);
  const double length = std::copysign(v.norm(), v[0]);
  v[0] += length;
  row_ = z + length * J_.col(q_);  // J2 v
  if (const double square = v.squaredNorm(); square > 0) {
    row_ *= 2 / square;
    J_.rightCols(rest).noalias() -= row_ * v.transpose();
  }
  R_.col(q_).head(q_) = d.head(q_);
  R_(q_, q_) = -length;
  ++q_;
}

/// The columns of R behind the row move left, and rotations make it triangular again.
void DenseQpFactors::drop(Eigen::Index position) {
  --q_;
  for (Eigen::Index i = position; i < q_; ++i) {
    R_.col(i).head(i + 2) = R_.col(i + 1).head(i + 2);
    Eigen::JacobiRotation<double> rotation;
    double length = 0;
    rotation.makeGivens(R_(i, i), R_(i + 1, i), &length);
    R_(i, i) = length;
    R_(i + 1, i) = 0;
    for (Eigen::Index j = i + 2; j <= q_; ++j) {  // columns that are still to move left
      const double upper = R_(i, j), lower = R_(i + 1, j);
      R_(i, j) = rotation.c() * upper - rotation.s() * lower;
      R_(i + 1, j) = rotation.s() * upper + rotation.c() * lower;
    }
    J_.applyOnTheRight(i, i + 1, rotation);
  }
}

}  // namespace palanquin
