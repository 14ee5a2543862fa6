"""Observed orders of convergence next to theory: the errors of one run, the study, and the page about it."""
