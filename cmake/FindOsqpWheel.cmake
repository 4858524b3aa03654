# OSQP out of the wheel casadi, as palanquin::osqp (the static library with QDLDL inside).
# Its symbols are kept out of what links it, so that another OSQP in the process does no harm.
include(FindPackageHandleStandardArgs)
include(${CMAKE_CURRENT_LIST_DIR}/PalanquinWheel.cmake)

palanquin_find_in_wheel(OsqpWheel_INCLUDE_DIR casadi casadi/include/osqp)
palanquin_find_in_wheel(OsqpWheel_LIBRARY casadi casadi/libosqpstatic.a)
find_package_handle_standard_args(OsqpWheel
  REQUIRED_VARS OsqpWheel_LIBRARY OsqpWheel_INCLUDE_DIR
  REASON_FAILURE_MESSAGE "Install it into the Python in use: pip install casadi")

if(OsqpWheel_FOUND AND NOT TARGET palanquin::osqp)
  add_library(palanquin::osqp STATIC IMPORTED)
  set_target_properties(palanquin::osqp PROPERTIES
    IMPORTED_LOCATION "${OsqpWheel_LIBRARY}"
    INTERFACE_SYSTEM_INCLUDE_DIRECTORIES "${OsqpWheel_INCLUDE_DIR}"
    INTERFACE_INCLUDE_DIRECTORIES "${OsqpWheel_INCLUDE_DIR}"
    INTERFACE_LINK_LIBRARIES "m;${CMAKE_DL_LIBS}"
    INTERFACE_LINK_OPTIONS "LINKER:--exclude-libs,ALL")
endif()
