"""The collection of optimal control problems, solved by every solver and judged independently."""
