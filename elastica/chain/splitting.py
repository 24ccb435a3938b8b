"""Links cut where the strip touches a wall: the chain that follows, and the conditions that find the cuts.

A contact at arc length s_c in link j divides it into two, ξ = N s_c − j:

               |<--- ξh --->|<-- (1−ξ)h -->|
         o-----------o======C=====o----------------o          C lies on the wall, θ_c = 0
        node j   θ_l        |       θ_r         node j + 1

Joints are as soft as the strip between the middles of their links: link i contributes the compliance a_i =
l_i/2EI_i to each of its joints, a_l = ξh/2EI and a_r = (1 − ξ)h/2EI at C. So ξ = 0 and ξ = 1 are ordinary:
one piece has no length and no compliance, the contact is a joint, and everything is continuous where the
contact passes from one link to the next. C has an angle of its own, a link without length: a_r (θ_c − θ_l)
= a_l (θ_r − θ_c). That it lies on the wall,

    θ_c = (a_r θ_l + a_l θ_r)/(a_l + a_r) = 0,        (point)

is the condition for s_c. Making s_c an unknown of the potential instead finds a maximum in s_c.

A line begins where θ = 0 and the moment is zero too. Its part of the link is left out with all that lies
flat; the piece before it has no spring at its end, which is the zero moment, and

    θ_l = 0        (line; at its other end θ_r = 0)

finds s_c: the strip there is θ ≈ λ (s − s_c)²/2, so that the middle of a piece of length ξh has an angle
O(h²). Moments are sums of loads by the midpoint rule, of second order everywhere, and so are both conditions.

In a uniform strip a segment between two lines may slide at no cost, and one between a clamp and a line at
none to second order: θ = 0 and no moment at one end imply the same at the other. Asking for both would
leave a chain, which only nearly has this freedom, without a solution. So the clamp rests (no moment there
either), the mean of the conditions at both ends,

    (θ_first + θ_last)/2 = 0,        (full period)

finds the length, and between two lines the segment stays centred where it started.

Ends: a clamp is a_0 away from the first link's angle, a spring c in series with that.

Not here: what follows from cutting (`equilibrium`), whole links on the wall (`published`).
"""

from typing import NamedTuple

import numpy as np

from elastica.chain.links import Chain
from elastica.chain.profile import Profile

FEWEST_LINKS = 4
"""Links that a free segment must span, so that its cut ends do not meet."""


class Mesh(NamedTuple):
    """The strip divided into equal links.

    Attributes
    ----------
    links : int
    stiffness : ndarray, shape (links,)
        EI of each link.
    profile : Profile
        EI along the strip.
    """

    links: int
    stiffness: np.ndarray
    profile: Profile

    @property
    def h(self):
        """Length of a link."""
        return 1 / self.links


def mesh_of(links, profile):
    """A mesh whose links have the stiffness of the profile at their middles."""
    middles = (np.arange(links) + 0.5) / links
    return Mesh(links, np.array(profile(middles)), profile)


class Contacts(NamedTuple):
    """What the strip touches: one cut for a point, two (beginning and end) for a line.

    Attributes
    ----------
    walls : tuple of int
        The wall of each contact: 1 upper, −1 lower.
    line : bool
        Whether the contacts are lines.
    resting : tuple of bool
        Whether the ends A and B are clamps without moment: next to a line of a uniform strip.
    """

    walls: tuple
    line: bool = False
    resting: tuple = (False, False)

    def rises(self, scene):
        """Height that each segment has to gain, shape (segments,)."""
        return np.diff(scene.height(np.array((0, *self.walls, 0))))

    @property
    def starts(self):
        """For each segment the cut where it starts, −1 for end A."""
        return np.arange(-1, 2 * len(self.walls), 2) if self.line else np.arange(-1, len(self.walls))

    @property
    def stops(self):
        """For each segment the cut where it stops; the last stops at end B, one past the cuts."""
        return self.starts + 1


NO_CONTACT, NO_CUTS = Contacts(()), np.zeros(0)


class Pieces(NamedTuple):
    """The links and parts of links that are free.

    Attributes
    ----------
    chain : Chain
    half : ndarray, shape (n,)
        Compliance l/2EI of half of each piece.
    link : ndarray of int, shape (n,)
        The link of the mesh that a piece is part of.
    middles : ndarray, shape (n,)
        Arc length of the middle of each piece.
    first, last : ndarray of int, shape (segments,)
        The first and the last piece of each segment.
    """

    chain: Chain
    half: np.ndarray
    link: np.ndarray
    middles: np.ndarray
    first: np.ndarray
    last: np.ndarray


def split(mesh, ends, contacts=NO_CONTACT, cuts=NO_CUTS):
    """Cut a mesh at the arc lengths `cuts`, ascending; without contacts not at all.

    Parameters
    ----------
    mesh : Mesh
    ends : Ends
    contacts : Contacts
    cuts : ndarray, shape (q,)

    Returns
    -------
    Pieces
        Without what lies flat. Where a line begins or ends there is no hold.
    """
    n, h = mesh.links, mesh.h
    bounds = np.concatenate([[0.0], cuts, [1.0]])
    begin, end = bounds[contacts.starts + 1], bounds[contacts.stops + 1]
    at = np.clip(np.floor(bounds * n).astype(int), 0, n - 1)
    from_link, to_link = at[contacts.starts + 1], at[contacts.stops + 1]
    counts = to_link - from_link + 1
    first = np.cumsum(counts) - counts
    last = first + counts - 1
    segment = np.repeat(np.arange(counts.size), counts)
    link = np.arange(counts.sum()) - first[segment] + from_link[segment]
    left, right = link * h, (link + 1) * h
    left[first], right[last] = begin, end
    lengths = np.full(link.size, h)
    lengths[first] = np.minimum((from_link + 1) * h, end) - begin
    lengths[last] = end - np.maximum(to_link * h, begin)
    half = lengths / (2 * mesh.stiffness[link])
    springs = 1 / (half[:-1] + half[1:])
    if contacts.line:
        springs[last[:-1]] = 0.0
    holds = np.zeros(link.size)
    for place, held, rests in zip((0, -1), ends, contacts.resting, strict=True):
        if not (held.pinned or rests):
            holds[place] = 1 / (half[place] + 1 / held.stiffness)
    return Pieces(Chain(lengths, springs, holds, segment), half, link, 0.5 * (left + right), first, last)


def moving_pieces(contacts, pieces):
    """Pieces that grow or shrink with each cut: lists of (piece, +1 or −1)."""
    first, last = pieces.first, pieces.last
    inner = range(len(contacts.walls))
    if contacts.line:
        return [side for k in inner for side in ([(last[k], 1)], [(first[k + 1], -1)])]
    return [[(last[k], 1), (first[k + 1], -1)] for k in inner]


def growth_of_gradient(mesh, pieces, piece, theta, p, lam):
    """Derivative of the chain's gradient by the length of one piece: more load, softer springs beside it.

    Parameters
    ----------
    mesh, pieces : Mesh, Pieces
    piece : int
    theta : ndarray, shape (n,)
    p : float
    lam : ndarray, shape (segments,)

    Returns
    -------
    rows : slice
        The piece and its neighbours.
    values : ndarray
    """
    chain, n = pieces.chain, theta.size
    softening = 1 / (2 * mesh.stiffness[pieces.link[piece]])
    rows = slice(max(piece - 1, 0), min(piece + 2, n))
    own = piece - rows.start
    values = np.zeros(rows.stop - rows.start)
    values[own] -= p * np.sin(theta[piece]) - lam[chain.segment[piece]] * np.cos(theta[piece])
    for joint in (piece - 1, piece):
        if 0 <= joint < n - 1:
            k = chain.springs[joint]
            change = -softening * k * k * (theta[joint + 1] - theta[joint])
            values[joint + 1 - rows.start] += change
            values[joint - rows.start] -= change
    return rows, values


class Conditions(NamedTuple):
    """The conditions that find the cuts: values (q,), derivatives by θ (q, n) and by the cuts (q, q)."""

    values: np.ndarray
    by_theta: np.ndarray
    by_cut: np.ndarray


def conditions(mesh, contacts, pieces, theta, cuts, centres):
    """Whether the contacts are where the strip lies on the wall.

    Parameters
    ----------
    mesh, contacts, pieces : Mesh, Contacts, Pieces
    theta : ndarray, shape (n,)
    cuts : ndarray, shape (q,)
    centres : ndarray, shape (contacts − 1,)
        Where the segments between two lines are centred; not used for points.

    Returns
    -------
    Conditions
    """
    q = cuts.size
    values, by_theta, by_cut = np.zeros(q), np.zeros((q, theta.size)), np.zeros((q, q))
    first, last = pieces.first, pieces.last
    if not contacts.line:
        for k in range(q):
            left, right = last[k], first[k + 1]
            total = pieces.half[left] + pieces.half[right]
            by_theta[k, left], by_theta[k, right] = pieces.half[right] / total, pieces.half[left] / total
            values[k] = by_theta[k] @ theta
            softening = 1 / (2 * mesh.stiffness[pieces.link[left]])
            by_cut[k, k] = softening * (theta[right] - theta[left]) / total
        return Conditions(values, by_theta, by_cut)
    ends = ((0, first[0], last[0]), (q - 1, last[-1], first[-1]))
    for (row, outer, inner), rests in zip(ends, contacts.resting, strict=True):
        by_theta[row, [outer, inner] if rests else [inner]] = 0.5 if rests else 1.0
        values[row] = by_theta[row] @ theta
    for j in range(1, len(contacts.walls)):
        stop, start = 2 * j - 1, 2 * j
        by_theta[stop, [first[j], last[j]]] = 0.5
        values[stop] = 0.5 * (theta[first[j]] + theta[last[j]])
        by_cut[start, [stop, start]] = 0.5
        values[start] = 0.5 * (cuts[stop] + cuts[start]) - centres[j - 1]
    return Conditions(values, by_theta, by_cut)
