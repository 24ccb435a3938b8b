"""Every equilibrium of a state: unknowns, roots, branches, and what rounding does to them."""
