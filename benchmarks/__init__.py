"""Benchmarks of whole planning steps, run by `palanquin bench NAME`.

Variants that are compared take turns, a few steps each, so that what else the machine does meets
all of them alike: ratios hold where single figures do not.
"""
