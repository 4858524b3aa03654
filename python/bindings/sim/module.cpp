#include "bindings.hpp"

NB_MODULE(_sim, m) {
  m.doc() = "Palanquin's whole-body control and stepping.";
  palanquin::bind_robot(m);
  palanquin::bind_dense_qp(m);
  palanquin::bind_control(m);
  palanquin::bind_estimation(m);
  palanquin::bind_simulation(m);
}
