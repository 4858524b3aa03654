#include "palanquin/core/manifold.hpp"

#include <cmath>

namespace palanquin {

Vector4 quaternion_multiply(const Vector4& a, const Vector4& b) {
  return {a[0] * b[0] - a[1] * b[1] - a[2] * b[2] - a[3] * b[3],
          a[0] * b[1] + a[1] * b[0] + a[2] * b[3] - a[3] * b[2],
          a[0] * b[2] - a[1] * b[3] + a[2] * b[0] + a[3] * b[1],
          a[0] * b[3] + a[1] * b[2] - a[2] * b[1] + a[3] * b[0]};
}

Vector4 quaternion_conjugate(const Vector4& q) { return {q[0], -q[1], -q[2], -q[3]}; }

Vector4 quaternion_exp(const Vector3& v) {
  // The series of cos and of sin(t)/t in t^2, t half the angle; their errors are below 3e-17 here.
  // Most steps are that small, and the series are several times faster.
  const double t2 = 0.25 * v.squaredNorm();
  if (t2 < 0.01) {
    const double cosine =
        1.0 - t2 * (1.0 / 2 - t2 * (1.0 / 24 - t2 * (1.0 / 720 - t2 * (1.0 / 40320))));
    const double sinc =
        1.0 - t2 * (1.0 / 6 - t2 * (1.0 / 120 - t2 * (1.0 / 5040 - t2 * (1.0 / 362880))));
    return {cosine, 0.5 * sinc * v[0], 0.5 * sinc * v[1], 0.5 * sinc * v[2]};
  }
  const double angle = 2.0 * std::sqrt(t2);
  const double half_sinc = std::sin(0.5 * angle) / angle;
  return {std::cos(0.5 * angle), half_sinc * v[0], half_sinc * v[1], half_sinc * v[2]};
}

Vector3 quaternion_log(const Vector4& q) {
  const double sign = q[0] < 0.0 ? -1.0 : 1.0;
  const Vector3 vec(sign * q[1], sign * q[2], sign * q[3]);
  // 2 asin(s)/s by its series where the quotient loses digits; its error is below 1e-16 there. Most
  // residuals of a solved problem are that small, and the series is several times faster.
  const double s2 = vec.squaredNorm();
  if (s2 < 1e-4)
    return (2.0 + s2 * (1.0 / 3 + s2 * (3.0 / 20 + s2 * (5.0 / 56 + s2 * (35.0 / 576))))) * vec;
  const double sine = std::sqrt(s2);
  return 2.0 * std::atan2(sine, sign * q[0]) / sine * vec;
}

Vector4 quaternion_plus(const Vector4& q, const Vector3& d) {
  return quaternion_multiply(q, quaternion_exp(d)).normalized();
}

Vector3 quaternion_minus(const Vector4& a, const Vector4& b) {
  return quaternion_log(quaternion_multiply(quaternion_conjugate(b), a));
}

Vector4 quaternion_interpolate(const Vector4& a, const Vector4& b, double t) {
  return quaternion_plus(a, t * quaternion_minus(b, a));
}

Vector4 quaternion_aligned(const Vector4& q, const Vector4& reference) {
  return q.dot(reference) < 0.0 ? Vector4(-q) : q;
}

}  // namespace palanquin
