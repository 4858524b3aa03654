#include "palanquin/control/planning/team.hpp"

#include <Eigen/QR>
#include <stdexcept>

#include "palanquin/control/planning/references.hpp"

namespace palanquin::planning {

namespace {
/// With m_l of the payload's mass at the hand of a robot of mass m, the force of all feet acts
/// below m_l r_hand / (m + m_l) while it stands.
Vector3 shift_under_load(const Carrier& carrier, double load) {
  Vector3 centre = Vector3::Zero();
  for (const Vector3& hip : carrier.hips) centre += hip / kFeet;
  return load / (carrier.mass + load) * carrier.hand - centre;
}

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

Team::Team(const Payload& load, std::vector<Carrier> robots, FeetBelow below)
    : payload(load), carriers(std::move(robots)), feet_below(below) {
  if (carriers.empty())
    throw std::invalid_argument("team: there is no robot; a payload needs at least one");
  const double share = payload.mass / static_cast<double>(carriers.size());
  for (const Carrier& carrier : carriers) {
    places.push_back(place_of(carrier));
    places.back().foot_shift =
        feet_below == FeetBelow::Load ? shift_under_load(carrier, share) : Vector3::Zero();
  }
}

}  // namespace palanquin::planning
