#include "bindings.hpp"

NB_MODULE(_core, m) {
  m.doc() = "Palanquin's C++ engine.";
  m.attr("compiler") = __VERSION__;
  palanquin::bind_core(m);
  palanquin::bind_solvers(m);
  palanquin::bind_stage_qp(m);
}
