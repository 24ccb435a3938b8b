"""The link–spring chain with element splitting: any stiffness profile, and a witness for the exact solver.

Reached as `elastica.solve(..., method="chain")`.

links        potential, gradient, Hessian of a chain     bordered    O(N) algebra: tridiagonal plus borders
splitting    links cut at contacts                       equilibrium Newton with contacts that move
start        exact states, stiffness profiles            second_variation, published   the energy method, twice
verdict      index and stability                         spectrum, vibration           eigenvalues, frequencies
resolution   how many links a load needs                 solution    arrays of points
"""
