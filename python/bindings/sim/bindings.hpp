#pragma once

#include <nanobind/nanobind.h>
#include <nanobind/ndarray.h>

#include <memory>
#include <utility>

#include "palanquin/control/whole_body/robot_controller.hpp"

namespace palanquin {

/// An attribute that holds a list of numbers: read as a tuple, since a change of a copy would be
/// lost without a word.
template <class Class, class List>
void def_list(nanobind::class_<Class>& bound, const char* name, List Class::* member) {
  using Numbers = nanobind::typed<nanobind::tuple, typename List::value_type, nanobind::ellipsis>;
  bound.def_prop_rw(
      name, [member](const Class& self) { return Numbers(nanobind::cast(self.*member)); },
      [member](Class& self, List list) { self.*member = std::move(list); });
}

using Rows = Eigen::Matrix<double, Eigen::Dynamic, 3>;

/// A copy of vectors side by side [3, n] as rows [n, 3] that can't be written.
inline nanobind::ndarray<nanobind::numpy, const double, nanobind::shape<-1, 3>> read_only(
    const Eigen::Matrix3Xd& columns) {
  auto copy = std::make_unique<Eigen::Matrix3Xd>(columns);
  const double* data = copy->data();
  const nanobind::capsule owner(copy.release(),
                                [](void* p) noexcept { delete static_cast<Eigen::Matrix3Xd*>(p); });
  return {data, {static_cast<std::size_t>(columns.cols()), 3}, owner};
}

/// An attribute of vectors side by side [3, n], in Python their rows [n, 3]. Their number may
/// change: handed out as a copy, since a view would dangle after the next assignment, and
/// read-only, since a change of the copy would be lost.
template <class Class>
void def_rows(nanobind::class_<Class>& bound, const char* name, Eigen::Matrix3Xd Class::* member,
              const char* doc) {
  bound.def_prop_rw(
      name, [member](const Class& self) { return read_only(self.*member); },
      [member](Class& self, const Rows& rows) { self.*member = rows.transpose(); },
      nanobind::for_getter(nanobind::rv_policy::automatic), doc);
}

void bind_robot(nanobind::module_& m);
void bind_dense_qp(nanobind::module_& m);
void bind_control(nanobind::module_& m);
void bind_estimation(nanobind::module_& m);
void bind_simulation(nanobind::module_& m);

}  // namespace palanquin
