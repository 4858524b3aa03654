#pragma once

#include <nanobind/nanobind.h>

namespace palanquin {

void bind_core(nanobind::module_& m);
void bind_solvers(nanobind::module_& m);
void bind_stage_qp(nanobind::module_& m);
void bind_grounds(nanobind::module_& m);
void bind_planning(nanobind::module_& m);
void bind_bar_planner(nanobind::module_& m);

}  // namespace palanquin
