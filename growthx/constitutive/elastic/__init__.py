"""Stored energies beside the paper's: each a function of invariants that keep the digits of small strains."""
