#include "palanquin/control/planning/team.hpp"

#include <Eigen/QR>
#include <stdexcept>

#include "palanquin/control/planning/references.hpp"

namespace palanquin::planning {

namespace {
Place place_of(const Carrier& carrier) {
  Place place;
  place.turn = from_yaw(carrier.yaw);
  place.offset = carrier.attach - rotation_matrix(place.turn) * carrier.hand;
  Eigen::Matrix<double, kFeet, 3> hips;
  for (int f = 0; f < kFeet; ++f) hips.row(f) << 1.0, carrier.hips[f].x(), carrier.hips[f].y();
  place.ground_fit = hips.completeOrthogonalDecomposition().pseudoInverse();
  return place;
}
}  // namespace

Team::Team(const Payload& load, std::vector<Carrier> robots)
    : payload(load), carriers(std::move(robots)) {
  if (carriers.empty())
    throw std::invalid_argument("team: there is no robot; a payload needs at least one");
  for (const Carrier& carrier : carriers) places.push_back(place_of(carrier));
}

}  // namespace palanquin::planning
