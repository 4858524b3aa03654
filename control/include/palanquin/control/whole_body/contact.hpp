#pragma once

#include <Eigen/Core>

#include "palanquin/core/manifold.hpp"

namespace palanquin {

constexpr int kConeSides = 8;
using ConeNormals = Eigen::Matrix<double, 3, kConeSides>;

/// Axes of a contact on ground with that normal (of any length over 0), to the world: two tangents
/// and the normal, the world's own where the ground is level.
Eigen::Matrix3d contact_frame(const Vector3& normal);

/// The pyramid of eight sides within the cone of friction, |f_t| <= mu f_n: a force in the
/// contact's axes is in it if `cone_normals(mu)' f >= 0`. Its edges are on the cone, along the
/// tangents and between them; between two edges it allows cos(pi / 8), 92 %, of mu.
ConeNormals cone_normals(double friction);

/// A limb that stands: it doesn't move, and pushes against the ground within its friction.
struct Contact {
  int limb = 0;
  Vector3 force = Vector3::Zero();                      ///< desired, of the world on it, world, N
  double friction = 0.6;                                ///< mu, not negative
  Eigen::Matrix3d frame = Eigen::Matrix3d::Identity();  ///< see `contact_frame`
  double least_force = 0;                               ///< along the normal, N
};

}  // namespace palanquin
