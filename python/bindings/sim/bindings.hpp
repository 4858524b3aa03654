#pragma once

#include <nanobind/nanobind.h>

namespace palanquin {

void bind_robot(nanobind::module_& m);
void bind_dense_qp(nanobind::module_& m);
void bind_control(nanobind::module_& m);
void bind_simulation(nanobind::module_& m);

}  // namespace palanquin
