"""The link-spring chain with element splitting: for any stiffness profile, and a second witness.

Reached as `elastica.solve(..., method="chain")`.

profile           the bending stiffness along the strip
links             potential, gradient and Hessian of a chain of any links
splitting         links cut where the strip touches a wall
bordered          O(N) algebra: tridiagonal matrices with a few borders
equilibrium       Newton's method with contacts that move
start             where it starts: exact states, continuation in the stiffness
resolution        how many links a load needs
settings          the two of them: what differs, chosen once by `clamp`
consistent        links cut where the strip touches, its energy method of second order
published         whole links on the wall, its energy method of first order
verdict           index, nullity and stability
spectrum          eigenvalues; vibration: natural frequencies
properties        heights, curvature, energies of one chain
model             one state at one point; solution: on arrays of points
"""
