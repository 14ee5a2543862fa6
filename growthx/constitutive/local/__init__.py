"""The balance of mass of one density, which no other enters: its root a time step later, for whole arrays."""
