"""States of a run in files for ParaView, one after another in time: which, on what cells, and in which format."""
