#include "bindings.hpp"

NB_MODULE(_core, m) {
  // Constants of Python modules, such as a default terrain, hold objects of this one until the
  // interpreter is gone; that is no leak.
  nanobind::set_leak_warnings(false);
  m.doc() = "Palanquin's C++ engine.";
  m.attr("compiler") = __VERSION__;
  palanquin::bind_core(m);
  palanquin::bind_solvers(m);
  palanquin::bind_stage_qp(m);
  palanquin::bind_grounds(m);
  palanquin::bind_planning(m);
  palanquin::bind_bar_planner(m);
}
