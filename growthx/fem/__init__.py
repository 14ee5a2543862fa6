"""Finite elements as DOLFINx has them: shapes of cells, compiled forms, assembly, condensation, numberings, differences
between versions.  Knows no body, no growth and no solver.
"""
