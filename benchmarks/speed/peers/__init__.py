"""The plate in NGSolve, felupe and scikit-fem beside growthx: how each is run, how they compare, and the page."""
