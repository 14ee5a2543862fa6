"""What acts on a body beside tractions: forces at points, nodes and along curves, springs, turned and twisted faces."""
