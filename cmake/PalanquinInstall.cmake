# What find_package(palanquin) finds: the static libraries, their headers, and the modules that
# locate Eigen, OSQP and Ipopt in the user's Python packages.
include(CMakePackageConfigHelpers)

add_library(palanquin INTERFACE)
add_library(palanquin::palanquin ALIAS palanquin)
target_link_libraries(palanquin INTERFACE palanquin_core palanquin_solvers palanquin_planning)

install(TARGETS palanquin palanquin_core palanquin_solvers palanquin_planning EXPORT palanquinTargets
  ARCHIVE DESTINATION ${PALANQUIN_INSTALL_LIBDIR})
install(DIRECTORY core/include/ solvers/include/ control/include/ DESTINATION ${PALANQUIN_INSTALL_INCLUDEDIR}
  FILES_MATCHING PATTERN "*.hpp")
install(EXPORT palanquinTargets NAMESPACE palanquin::
  DESTINATION ${PALANQUIN_INSTALL_CMAKEDIR})

configure_package_config_file(cmake/palanquinConfig.cmake.in palanquinConfig.cmake
  INSTALL_DESTINATION ${PALANQUIN_INSTALL_CMAKEDIR} NO_SET_AND_CHECK_MACRO)
write_basic_package_version_file(palanquinConfigVersion.cmake COMPATIBILITY SameMinorVersion)
install(FILES
  ${CMAKE_CURRENT_BINARY_DIR}/palanquinConfig.cmake
  ${CMAKE_CURRENT_BINARY_DIR}/palanquinConfigVersion.cmake
  cmake/PalanquinWheel.cmake
  cmake/FindEigenWheel.cmake
  cmake/FindOsqpWheel.cmake
  cmake/FindIpoptWheel.cmake
  DESTINATION ${PALANQUIN_INSTALL_CMAKEDIR})
