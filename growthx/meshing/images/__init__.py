"""Scans of a body: voxels and their places, read as NIfTI or given as arrays, and the density that they mean."""
