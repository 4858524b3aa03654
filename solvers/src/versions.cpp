#include "palanquin/solvers/versions.hpp"

#include <IpoptConfig.h>
#include <osqp.h>

#include <Eigen/Core>

namespace palanquin {

std::map<std::string, std::string> library_versions() {
  const auto dotted = [](int world, int major, int minor) {
    return std::to_string(world) + "." + std::to_string(major) + "." + std::to_string(minor);
  };
  return {{"Eigen", dotted(EIGEN_WORLD_VERSION, EIGEN_MAJOR_VERSION, EIGEN_MINOR_VERSION)},
          {"Ipopt", IPOPT_VERSION},
          {"OSQP", osqp_version()}};
}

}  // namespace palanquin
