"""Which exponents, histories, time steps, loads, cells and units the discretisations survive."""
