"""What happens at one point of a body: kinematics, stored energy and stress, mass sources and fluxes, written once for
floats, arrays and UFL.  Knows no mesh and no solver.
"""
