"""The initial boundary value problem as frozen data: what grows, how it is held and loaded, for how long; and what can
be said of it before there is a discretisation.  Knows no elements and no solver.
"""
