# Pinocchio out of the wheel libpinocchio, as palanquin::pinocchio: its headers, with those of Boost
# and Coal that they include, and the library that holds the algorithms' instantiations for double.
include(FindPackageHandleStandardArgs)
include(${CMAKE_CURRENT_LIST_DIR}/PalanquinWheel.cmake)

palanquin_find_in_wheel(PinocchioWheel_INCLUDE_DIR libpinocchio cmeel.prefix/include)
palanquin_find_in_wheel(PinocchioWheel_LIBRARY
  libpinocchio cmeel.prefix/lib/libpinocchio_default.so)
find_package_handle_standard_args(PinocchioWheel
  REQUIRED_VARS PinocchioWheel_LIBRARY PinocchioWheel_INCLUDE_DIR
  REASON_FAILURE_MESSAGE "Install it into the Python in use: pip install libpinocchio")

if(PinocchioWheel_FOUND AND NOT TARGET palanquin::pinocchio)
  add_library(palanquin::pinocchio SHARED IMPORTED)
  set_target_properties(palanquin::pinocchio PROPERTIES
    IMPORTED_LOCATION "${PinocchioWheel_LIBRARY}"
    IMPORTED_SONAME libpinocchio_default.so)
  target_include_directories(palanquin::pinocchio SYSTEM INTERFACE
    "${PinocchioWheel_INCLUDE_DIR}" "${PinocchioWheel_INCLUDE_DIR}/pinocchio/deprecated")
  # As its own CMake configuration defines them: they decide the layout of its types.
  target_compile_definitions(palanquin::pinocchio INTERFACE
    PINOCCHIO_ENABLE_TEMPLATE_INSTANTIATION
    PINOCCHIO_WITH_COLLISION
    BOOST_MPL_LIMIT_LIST_SIZE=30
    BOOST_MPL_LIMIT_VECTOR_SIZE=30
    BOOST_MPL_CFG_NO_PREPROCESSED_HEADERS
    BOOST_FUSION_INVOKE_MAX_ARITY=12)
endif()
