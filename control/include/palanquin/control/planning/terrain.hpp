#pragma once

#include <array>
#include <memory>
#include <string>
#include <vector>

#include "palanquin/control/planning/arrays.hpp"
#include "palanquin/core/lowered_function.hpp"

namespace palanquin::planning {

/// A parameter of a problem that describes the ground around one foothold.
struct LocalParameter {
  std::string name;
  int size;
};

/// Footholds to choose from, the nearest first.
struct Offers {
  static constexpr int kMost = 6;
  std::array<Vector3, kMost> points;
  int count = 0;
};

/// A smooth height map z_g over the world's xy-plane, m, and where feet may stand on it. Const,
/// shared by threads, does not allocate.
class Terrain {
 public:
  virtual ~Terrain() = default;
  /// z_g, m.
  virtual double height(double x, double y) const = 0;
  /// (dz/dx, dz/dy).
  virtual Vector2 slope(double x, double y) const = 0;
  /// Whether the slope is the same everywhere, as far as one knows.
  virtual bool is_plane() const { return false; }
  /// The ground as bodies follow it: the terrain itself unless it is rough.
  virtual const Terrain& trend() const { return *this; }

  /// What describes the ground around one foothold to a problem; nothing unless told.
  virtual std::vector<LocalParameter> local_parameters() const { return {}; }
  /// Their values around a foothold in the world, one parameter after the other.
  virtual void around(const Vector3& /*foothold*/, double* /*values*/) const {}

  /// Whether there are places where no foot may stand.
  virtual bool has_gaps() const { return false; }
  /// The foothold nearest to a point: here the one below it.
  virtual Vector3 nearest(const Vector3& wanted) const {
    return {wanted.x(), wanted.y(), height(wanted.x(), wanted.y())};
  }
  virtual Offers options(const Vector3& wanted) const;

  /// Appends the lines that state it in a planner's file; what it needs beside goes into `folder`.
  virtual void write(std::string& text, const std::string& folder) const = 0;
};

/// z_g = z0 + ax x + ay y + H/2 (1 + tanh(rate/2 (x - xg))): flat, plane, and the logistic ramp
/// (17) of De Vincenti and Coros with rate = 4 kappa / H.
class PlaneWithRamp : public Terrain {
 public:
  /// (z0, ax, ay) in m and m/m; (H, rate, xg) in m, 1/m, m.
  PlaneWithRamp(const Vector3& plane, const Vector3& ramp) : plane_(plane), ramp_(ramp) {}
  double height(double x, double y) const override;
  Vector2 slope(double x, double y) const override;
  bool is_plane() const override { return ramp_[0] * ramp_[1] == 0.0; }
  void write(std::string& text, const std::string& folder) const override;

 private:
  Vector3 plane_, ramp_;
};

/// A height map whose formula was lowered to a function `terrain`: (x, y) to z_g and its slope.
class LoweredTerrain : public Terrain {
 public:
  /// Throws std::runtime_error when the library cannot be loaded.
  explicit LoweredTerrain(const std::string& library);
  double height(double x, double y) const override { return evaluate(x, y)[0]; }
  Vector2 slope(double x, double y) const override { return evaluate(x, y).tail<2>(); }
  /// With a copy of the library, "terrain.so".
  void write(std::string& text, const std::string& folder) const override;

 private:
  Vector3 evaluate(double x, double y) const;

  LoweredLibrary library_;
  LoweredFunction function_;
};

}  // namespace palanquin::planning
