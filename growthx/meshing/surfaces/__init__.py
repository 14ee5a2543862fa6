"""The surface of a body: its sides, those within a set of nodes, and its pieces between sharp edges.

`sides` knows DOLFINx's meshes only, `patches` the mesh with names as well.
"""
