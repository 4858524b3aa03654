# Where things are installed. In a wheel all of it lives inside the Python package, so that one
# `pip install` serves C++ users as well; elsewhere the usual folders of a prefix are used.
if(SKBUILD)
  set(PALANQUIN_INSTALL_INCLUDEDIR palanquin/include)
  set(PALANQUIN_INSTALL_LIBDIR palanquin/lib)
  set(PALANQUIN_INSTALL_CMAKEDIR palanquin/cmake)
else()
  set(PALANQUIN_INSTALL_INCLUDEDIR ${CMAKE_INSTALL_INCLUDEDIR})
  set(PALANQUIN_INSTALL_LIBDIR ${CMAKE_INSTALL_LIBDIR})
  set(PALANQUIN_INSTALL_CMAKEDIR ${CMAKE_INSTALL_LIBDIR}/cmake/palanquin)
endif()
