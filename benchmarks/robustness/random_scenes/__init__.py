"""Random scenes, each from its number alone, whose solutions are checked by an assembly of its own in NumPy."""
