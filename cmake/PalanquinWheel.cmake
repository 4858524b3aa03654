# palanquin_find_in_wheel(<variable> <distribution> <path>): the absolute path of a file or folder
# that an installed Python distribution brings along, or <variable>-NOTFOUND. The result is cached.
#
# Looked for first in the site-packages that hold this file (a palanquin installed by pip, used from
# C++), then by asking the interpreter Python_EXECUTABLE, which knows about build isolation as well.
include_guard(GLOBAL)

function(palanquin_find_in_wheel variable distribution path)
  if(${variable} AND EXISTS "${${variable}}")
    return()
  endif()
  get_filename_component(site_packages "${CMAKE_CURRENT_FUNCTION_LIST_DIR}/../.." ABSOLUTE)
  set(found "${site_packages}/${path}")
  if(NOT EXISTS "${found}")
    if(NOT Python_EXECUTABLE)
      find_package(Python 3.11 REQUIRED COMPONENTS Interpreter)
    endif()
    execute_process(
      COMMAND "${Python_EXECUTABLE}" -c
        "import importlib.metadata as m; print(m.distribution('${distribution}').locate_file('${path}'))"
      OUTPUT_VARIABLE found OUTPUT_STRIP_TRAILING_WHITESPACE ERROR_QUIET)
  endif()
  if(NOT found OR NOT EXISTS "${found}")
    set(found "${variable}-NOTFOUND")
  endif()
  set(${variable} "${found}" CACHE PATH "${path} of the Python package ${distribution}" FORCE)
  mark_as_advanced(${variable})
endfunction()
