"""Pictures of bodies in space: the body on one rank, planes that cut it, and the panels that show it."""
