"""Sums over cells, of one or several cells at once: energies, forces and tangents by the compiled kernels."""
