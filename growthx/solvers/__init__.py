"""Nonlinear and linear solvers, with PETSc.  They know a system by the protocol in `problem` alone: no physics."""
