#include "bindings.hpp"

NB_MODULE(_core, m) {
  m.doc() = "Palanquin's C++ engine.";
  palanquin::bind_core(m);
  palanquin::bind_solvers(m);
}
