"""Which steps and loads the solver gets through, with what measures."""
