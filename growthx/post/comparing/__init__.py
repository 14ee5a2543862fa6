"""The density of a run beside another one, of a scan or of another run: how far apart they are, and where."""
