"""Time integration: schemes, the choice of steps, a step in parts where it must be, the march and what it records."""
