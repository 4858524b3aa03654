// Compiled once per processor level (cmake/PalanquinKernels.cmake) and free of inline functions
// from elsewhere, see there.
#include "kernels.hpp"

#include "local_group.hpp"
#include "partial_cholesky.hpp"
#include "rows_above.hpp"
#include "sparse_product.hpp"
#include "sparse_runs.hpp"
#include "symmetric.hpp"
#include "weighted_rows.hpp"

namespace palanquin::kernels::PALANQUIN_KERNEL_NAMESPACE {

extern const Table kTable;
const Table kTable = {
    .symmetrize = symmetrize,
    .multiply_transposed = multiply_transposed,
    .multiply_lower = multiply_lower,
    .substitute = substitute,
    .add_weighted_rows = add_weighted_rows,
    .eliminate_groups = eliminate_groups,
    .back_substitute_groups = back_substitute_groups,
    .forward_substitute_groups = forward_substitute_groups,
    .multiply_add = multiply_add,
    .multiply_runs_add = multiply_runs_add,
    .list_rows_above = list_rows_above,
    .symmetric_multiply = symmetric_multiply,
    .partial_cholesky = partial_cholesky,
    .back_substitute = back_substitute,
    .forward_substitute = forward_substitute,
};

}  // namespace palanquin::kernels::PALANQUIN_KERNEL_NAMESPACE
