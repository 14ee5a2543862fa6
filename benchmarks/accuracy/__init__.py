"""How near to the truth: orders of convergence, the paper's numbers, and errors over the time they cost."""
