"""A scene on elements: spaces, state, supports and loads, the weak forms, and the system of one time step, which
Newton's method sees as `solvers.problem` says.
"""
