#pragma once

#include <memory>

#include "palanquin/control/planning/terrain.hpp"

namespace palanquin::planning {

/// Ground from samples on a grid: a tensor-product cubic B-spline,
///
///   z_g(x, y) = sum_ij c_ij B(u - j) B(v - i),   u = (x - x0) / h,  v = (y - y0) / h,
///
/// with the cardinal spline B (de Boor, A Practical Guide to Splines). Beyond its edges a map goes
/// on as it ends there. Problems see its second-order expansion around each foothold.
class HeightMap : public Terrain {
 public:
  static constexpr int kRepeated = 8;  ///< coefficients beyond each edge

  /// Coefficients c_ij [rows + 16, columns + 16] with those at the edges repeated beyond them, rows
  /// along y; (x0, y0) and h in m; the ground as bodies follow it, itself if there is none.
  HeightMap(RowMatrix coefficients, const Vector2& origin, double spacing,
            std::shared_ptr<const Terrain> trend);

  double height(double x, double y) const override { return at(x, y).derivative(0, 0); }
  Vector2 slope(double x, double y) const override;
  const Terrain& trend() const override { return trend_ ? *trend_ : *this; }
  std::vector<LocalParameter> local_parameters() const override {
    return {{"centre", 2}, {"surface", 6}};
  }
  /// The centre (x, y), and there (z, zx, zy, zxx, zxy, zyy).
  void around(const Vector3& foothold, double* values) const override;
  void write(std::string& text, const std::string& folder) const override;

 private:
  /// The 4 x 4 coefficients that count at a point, and its place among them.
  struct Patch {
    Eigen::Matrix4d values;
    double u, v, spacing;
    /// d^(m+n) z / dx^m dy^n.
    double derivative(int m, int n) const;
  };
  Patch at(double x, double y) const;

  RowMatrix coefficients_;
  Vector2 origin_;
  double spacing_;
  std::shared_ptr<const Terrain> trend_;
};

}  // namespace palanquin::planning
