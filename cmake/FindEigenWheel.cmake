# Eigen's headers out of the wheel cmeel-eigen, as Eigen3::Eigen.
include(FindPackageHandleStandardArgs)
include(${CMAKE_CURRENT_LIST_DIR}/PalanquinWheel.cmake)

palanquin_find_in_wheel(EigenWheel_INCLUDE_DIR cmeel-eigen cmeel.prefix/include/eigen3)
find_package_handle_standard_args(EigenWheel
  REQUIRED_VARS EigenWheel_INCLUDE_DIR
  REASON_FAILURE_MESSAGE "Install it into the Python in use: pip install cmeel-eigen")

if(EigenWheel_FOUND AND NOT TARGET Eigen3::Eigen)
  add_library(Eigen3::Eigen INTERFACE IMPORTED)
  target_include_directories(Eigen3::Eigen SYSTEM INTERFACE "${EigenWheel_INCLUDE_DIR}")
endif()
