"""Angle and position along one free segment, by Jacobi functions.

Along the phase u = u₀ + √F s, with ψ = θ − α,

    tan(ψ/2) = √m sn/dn(u|m),      ψ' = 2√(Fm) cn(u|m),      ∫ cos ψ ds = 2ΔE/√F − s,

where E(u) = E(am u|m) (DLMF 22.16(ii)); sin ψ = −ψ''/F integrates to the change of ψ'.

Not here: where the segment lies in the strip (`shapes`).
"""

from typing import NamedTuple

import numpy as np

from elastica.pendulum.segments import crossing_sign
from elastica.pendulum.spring_end import spring_end
from elastica.pendulum.theta import Series, series, values


def start_phase(kind, q):
    """Phase u₀ = F(φ|m) at the start of a segment, shape (n,)."""
    if np.isfinite(kind.start_spring):
        c, sigma = kind.springs[0]
        return 2 * float(kind.start) * q.K + spring_end(c, sigma, q).F
    return 2 * float(kind.start) * q.K + crossing_sign(kind.start) * q.f


def directions(q, u):
    """Cosine and sine of the angle ψ = θ − α.

    Parameters
    ----------
    q : Pendulum
        Arrays that broadcast with u.
    u : ndarray
        Phases, of the shape of the result.

    Returns
    -------
    cos_psi, sin_psi : ndarray
        With all their relative digits where ψ is small.
    """
    own = series(q.m, q.m1, q.K, q.DK)
    sin, cos, *_ = values(own, own.rate * u)
    sin_square, cos_square = sin * sin, cos * cos
    scale = 1 / (sin_square + cos_square)
    return (cos_square - sin_square) * scale, 2 * sin * cos * scale


class Course(NamedTuple):
    """Segments as functions of arc length, arrays of one shape.

    With Jacobi's functions of `series` at z = `start` + `speed`·(arc length), and their changes Δ from the
    values `bend` and `zeta` at the start,

        θ = `angle` + `turn`·atan2(√m sn, dn)
        x = `x` + `x_along`·(arc length) + `x_bend`·Δ(cn) + `x_zeta`·Δ(zeta),      and y likewise.
    """

    start: np.ndarray
    speed: np.ndarray
    bend: np.ndarray
    zeta: np.ndarray
    angle: np.ndarray
    turn: np.ndarray
    x: np.ndarray
    x_along: np.ndarray
    x_bend: np.ndarray
    x_zeta: np.ndarray
    y: np.ndarray
    y_along: np.ndarray
    y_bend: np.ndarray
    y_zeta: np.ndarray
    series: Series

    def at(self, along):
        """Angle θ, x and y at arc lengths, of the result's shape, against which the segments broadcast."""
        sine, level, bend, zeta = values(self.series, self.start + self.speed * along)
        bend, zeta = bend - self.bend, zeta - self.zeta
        return (
            self.angle + self.turn * np.arctan2(sine, level),
            self.x + (self.x_along * along + (self.x_bend * bend + self.x_zeta * zeta)),
            self.y + (self.y_along * along + (self.y_bend * bend + self.y_zeta * zeta)),
        )

    def placed(self, x, y, side, ahead):
        """From x and y on, mirrored at the axis where `side` is −1, and led backwards where `ahead` is −1."""
        return self._replace(
            angle=side * ahead * self.angle,
            turn=side * ahead * self.turn,
            x=x,
            x_along=ahead * self.x_along,
            x_bend=ahead * self.x_bend,
            x_zeta=ahead * self.x_zeta,
            y=y,
            y_along=side * self.y_along,
            y_bend=side * self.y_bend,
            y_zeta=side * self.y_zeta,
        )


def course(u, q):
    """The way from phase u on, in the rising convention and from x = y = 0.

    Parameters
    ----------
    u : ndarray, shape (...,)
    q : Pendulum
        Arrays of the same shape.

    Returns
    -------
    Course
    """
    own = series(q.m, q.m1, q.K, q.DK)
    start = own.rate * u
    here = values(own, start)
    stretch, bend, zeta = 2 * own.steady - 1, -2 * own.bend / q.r, 2 * own.rate / q.r
    cos, sin, zero = q.cos_alpha, q.sin_alpha, np.zeros_like(start)
    return Course(
        start=start,
        speed=own.rate * q.r,
        bend=here.bend,
        zeta=here.zeta,
        angle=q.alpha,
        turn=zero + 2,
        x=zero,
        x_along=cos * stretch,
        x_bend=-sin * bend,
        x_zeta=cos * zeta,
        y=zero,
        y_along=sin * stretch,
        y_bend=cos * bend,
        y_zeta=sin * zeta,
        series=own,
    )
