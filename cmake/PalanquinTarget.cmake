# Beyond the usual: a function that overrides or hides another one by accident, numbers that lose
# their sign or digits on the way, casts that hide it, and conditions that can't be meant.
# -Wsign-conversion is not among them: Eigen's indices are signed, the standard library's are not.
set(PALANQUIN_WARNINGS
  -Wall -Wextra -Wpedantic -Wshadow
  -Wsuggest-override -Woverloaded-virtual -Wnon-virtual-dtor
  -Wconversion -Wno-sign-conversion -Wdouble-promotion -Wold-style-cast -Wcast-qual
  -Wextra-semi -Wredundant-decls -Wformat=2
  $<$<CXX_COMPILER_ID:GNU>:-Wduplicated-cond>
  $<$<CXX_COMPILER_ID:GNU>:-Wduplicated-branches>
  $<$<CXX_COMPILER_ID:GNU>:-Wlogical-op>)

# palanquin_target(<target>): the language level and the warnings of all our own targets.
# A compiler newer than ours may know more warnings: configure with --compile-no-warning-as-error.
# Nothing reads errno or the processor's exception flags after arithmetic; a square root that sets
# neither is one instruction without a branch. NaN and infinity keep their meaning.
function(palanquin_target target)
  target_compile_features(${target} PUBLIC cxx_std_20)
  target_compile_options(${target} PRIVATE
    ${PALANQUIN_WARNINGS} -fno-math-errno -fno-trapping-math)
  set_target_properties(${target} PROPERTIES
    CXX_EXTENSIONS OFF
    POSITION_INDEPENDENT_CODE ON
    CXX_VISIBILITY_PRESET hidden
    VISIBILITY_INLINES_HIDDEN ON
    COMPILE_WARNING_AS_ERROR ON)
endfunction()

# palanquin_add_library(<name> [<folder>]): the static library palanquin_<name>, alias
# palanquin::<name>, from <folder> (src/ unless told, less what PalanquinKernels.cmake compiles) and
# include/ of the calling folder.
function(palanquin_add_library name)
  set(folder ${ARGN})
  if(NOT folder)
    set(folder src)
  endif()
  file(GLOB_RECURSE sources CONFIGURE_DEPENDS ${folder}/*.cpp)
  list(FILTER sources EXCLUDE REGEX "/kernels/kernels[.]cpp$")
  add_library(palanquin_${name} STATIC ${sources})
  add_library(palanquin::${name} ALIAS palanquin_${name})
  set_target_properties(palanquin_${name} PROPERTIES EXPORT_NAME ${name})
  target_include_directories(palanquin_${name}
    PUBLIC
      $<BUILD_INTERFACE:${CMAKE_CURRENT_SOURCE_DIR}/include>
      $<INSTALL_INTERFACE:${PALANQUIN_INSTALL_INCLUDEDIR}>
    PRIVATE src)
  palanquin_target(palanquin_${name})
endfunction()

# palanquin_add_test(<name> SOURCES ... [LIBRARIES ...]): one GoogleTest executable, its cases known
# to ctest one by one. Part of the target palanquin_tests, not of a plain build. Tests find lowered
# problems in the folder that the fixture lowered_problems (tests/CMakeLists.txt) fills.
function(palanquin_add_test name)
  cmake_parse_arguments(PARSE_ARGV 1 arg "" "" "SOURCES;LIBRARIES")
  add_executable(${name} EXCLUDE_FROM_ALL ${arg_SOURCES})
  target_link_libraries(${name} PRIVATE ${arg_LIBRARIES} GTest::gtest GTest::gtest_main)
  target_include_directories(${name} PRIVATE ${PROJECT_SOURCE_DIR}/tests)
  palanquin_target(${name})
  add_dependencies(palanquin_tests ${name})
  gtest_discover_tests(${name} TEST_PREFIX ${name}. DISCOVERY_TIMEOUT 60 PROPERTIES
    FIXTURES_REQUIRED lowered_problems
    ENVIRONMENT PALANQUIN_LOWERED_PROBLEMS=${PALANQUIN_LOWERED_PROBLEMS})
endfunction()
