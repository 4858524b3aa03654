# Fails if one of OBJECTS, a kernel compiled for a newer processor, defines a symbol that the linker
# may take for another translation unit's (see cmake/PalanquinKernels.cmake).
foreach(object IN LISTS OBJECTS)
  execute_process(COMMAND ${NM} --defined-only --demangle ${object}
    OUTPUT_VARIABLE symbols COMMAND_ERROR_IS_FATAL ANY)
  string(REGEX MATCHALL "[0-9a-f]+ [VvWwu] [^\n]*" shared "${symbols}")
  if(shared)
    list(JOIN shared "\n  " shared)
    message(FATAL_ERROR "${object} shares inline symbols with other code:\n  ${shared}")
  endif()
endforeach()
