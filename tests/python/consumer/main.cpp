// A user's program: turns a quaternion by its first argument, radians about z, and prints it.
#include <cstdlib>
#include <iostream>

#include "palanquin/core/manifold.hpp"

int main(int argc, char** argv) {
  if (argc != 2) return EXIT_FAILURE;
  const palanquin::Vector4 identity(1.0, 0.0, 0.0, 0.0);
  const palanquin::Vector3 turn(0.0, 0.0, std::atof(argv[1]));
  std::cout << palanquin::quaternion_plus(identity, turn).transpose() << '\n';
  return EXIT_SUCCESS;
}
