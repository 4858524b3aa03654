"""The whole-body controller's small QPs, recorded in runs, solved by ours and by other solvers."""
