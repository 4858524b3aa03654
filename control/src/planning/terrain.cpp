#include "palanquin/control/planning/terrain.hpp"

#include <cmath>

namespace palanquin::planning {

Offers Terrain::options(const Vector3& wanted) const {
  Offers offers;
  offers.points[0] = nearest(wanted);
  offers.count = 1;
  return offers;
}

double PlaneWithRamp::height(double x, double y) const {
  const double rise = 1.0 + std::tanh(ramp_[1] / 2 * (x - ramp_[2]));
  return plane_[0] + plane_[1] * x + plane_[2] * y + ramp_[0] / 2 * rise;
}

Vector2 PlaneWithRamp::slope(double x, double /*y*/) const {
  const double t = std::tanh(ramp_[1] / 2 * (x - ramp_[2]));
  return {plane_[1] + ramp_[0] * ramp_[1] / 4 * (1.0 - t * t), plane_[2]};
}

LoweredTerrain::LoweredTerrain(const std::string& library)
    : library_(library), function_(library_, "terrain") {}

Vector3 LoweredTerrain::evaluate(double x, double y) const {
  thread_local FunctionWorkspace work;  // the function is shared by threads
  function_.prepare(work);
  const double xy[2] = {x, y};
  Vector3 result;
  work.arguments[0] = xy;
  work.results[0] = result.data();
  function_(work);
  return result;
}

}  // namespace palanquin::planning
