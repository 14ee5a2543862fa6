"""Which discretisation and which time steps reach an error in the least time: the cases, the runs, and the page."""
