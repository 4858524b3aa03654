# Ipopt with MUMPS out of the wheel casadi, as palanquin::ipopt.
include(FindPackageHandleStandardArgs)
include(${CMAKE_CURRENT_LIST_DIR}/PalanquinWheel.cmake)

palanquin_find_in_wheel(IpoptWheel_INCLUDE_DIR casadi casadi/include/coin-or)
palanquin_find_in_wheel(IpoptWheel_LIBRARY casadi casadi/libipopt.so.3)
find_package_handle_standard_args(IpoptWheel
  REQUIRED_VARS IpoptWheel_LIBRARY IpoptWheel_INCLUDE_DIR
  REASON_FAILURE_MESSAGE "Install it into the Python in use: pip install casadi")

if(IpoptWheel_FOUND AND NOT TARGET palanquin::ipopt)
  add_library(palanquin::ipopt SHARED IMPORTED)
  set_target_properties(palanquin::ipopt PROPERTIES
    IMPORTED_LOCATION "${IpoptWheel_LIBRARY}"
    IMPORTED_SONAME libipopt.so.3
    INTERFACE_SYSTEM_INCLUDE_DIRECTORIES "${IpoptWheel_INCLUDE_DIR}"
    INTERFACE_INCLUDE_DIRECTORIES "${IpoptWheel_INCLUDE_DIR}")
endif()
