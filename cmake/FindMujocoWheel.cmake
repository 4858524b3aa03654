# MuJoCo out of the wheel mujoco-core, as palanquin::mujoco: the very library that the Python package
# mujoco loads, so that C++ steps the models and states that Python made.
include(FindPackageHandleStandardArgs)
include(${CMAKE_CURRENT_LIST_DIR}/PalanquinWheel.cmake)

palanquin_find_in_wheel(MujocoWheel_INCLUDE_DIR mujoco-core mujoco/include)
palanquin_find_in_wheel(MujocoWheel_LIBRARY mujoco-core mujoco/libmujoco.so.4.0.0)
find_package_handle_standard_args(MujocoWheel
  REQUIRED_VARS MujocoWheel_LIBRARY MujocoWheel_INCLUDE_DIR
  REASON_FAILURE_MESSAGE "Install it into the Python in use: pip install mujoco-core==4.0.0")

if(MujocoWheel_FOUND AND NOT TARGET palanquin::mujoco)
  add_library(palanquin::mujoco SHARED IMPORTED)
  set_target_properties(palanquin::mujoco PROPERTIES
    IMPORTED_LOCATION "${MujocoWheel_LIBRARY}"
    IMPORTED_SONAME libmujoco.so.4.0.0)
  target_include_directories(palanquin::mujoco SYSTEM INTERFACE "${MujocoWheel_INCLUDE_DIR}")
endif()
