"""The ways to solve for the densities: as unknowns beside the displacements, or one by one and eliminated.

Each is what `system.Densities` asks for; all else of a step is shared.
"""
