# palanquin_add_kernels(<target> <source>): compiles <source> into <target> once for each processor
# level below, each time with PALANQUIN_KERNEL_NAMESPACE set to the level's name, so that the
# library can choose at run time and nothing else needs processor flags.
#
# Such a source may call nothing inline from outside itself (no Eigen, no standard containers): the
# linker keeps one copy of an inline function, and were that the AVX-512 one, a plain x86-64
# processor would stop with an illegal instruction. tests/solvers checks the objects for this.
# So they see the headers of their own folder's include/ and no library's.
set(PALANQUIN_KERNEL_LEVELS x86_64 avx2 avx512)
set(PALANQUIN_KERNEL_FLAGS_x86_64 "")
set(PALANQUIN_KERNEL_FLAGS_avx2 -mavx2 -mfma)
set(PALANQUIN_KERNEL_FLAGS_avx512
  -mavx2 -mfma -mavx512f -mavx512dq -mavx512vl -mavx512bw -mprefer-vector-width=512)

function(palanquin_add_kernels target source)
  foreach(level IN LISTS PALANQUIN_KERNEL_LEVELS)
    set(objects ${target}_kernels_${level})
    add_library(${objects} OBJECT ${source})
    target_include_directories(${objects} PRIVATE include)
    target_compile_definitions(${objects} PRIVATE PALANQUIN_KERNEL_NAMESPACE=${level})
    target_compile_options(${objects} PRIVATE ${PALANQUIN_KERNEL_FLAGS_${level}})
    palanquin_target(${objects})
    target_sources(${target} PRIVATE $<TARGET_OBJECTS:${objects}>)
  endforeach()
endfunction()
