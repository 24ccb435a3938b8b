"""Names of states: what they mean, their canonical form, and the segments they are made of.

0            straight
B1 B2 …      free buckling in mode n, no contact
U UD UU …    the walls touched, from end A to end B (U upper, D lower)
a… …a        the end segment on that side is of kind A: the strip first bends away from the wall
…-           line regime: the contacts are lines, κ = 0
…:2 :3       higher roots of the same word, by increasing κ

Of mirror images one has a name: it starts with U and, where both ends are alike, comes last in the alphabet
(UUD, not UDD; Ua, not aU). The other names are understood too.

Between contacts and ends the strip is free. Its pieces are of few kinds, drawn here as they rise to the
upper wall (║ clamp, ○ pin; at clamps and contacts the strip is parallel to the walls):

      S  clamp to wall           A  clamp to wall                0  a wall to itself
     ━━━━━━━━━━━━━━━━━━━━━━     ━━━━━━━━━━━━━━━━━━━━━━━━━━━    ━━━━━━━━━━━━━━━━━━━━━━
                   _.-''''                          _.-'''    '''-._          _.-'''
                _.'                             _.'                '-..__..-'
              .-                              .'
           _-'                              .-
    ║____.-'                   ║---..______.-

      S  from a pin              A  from a pin                   S  a wall to the other
     ━━━━━━━━━━━━━━━━━          ━━━━━━━━━━━━━━━━━━━━━━━━━━━    ━━━━━━━━━━━━━━━━━━━━━━━━━━
             _.-''''                          _.-'''                       _.--'''''
          _-'                             .-'                           _-'
        .-                              .'                             _'
      _-                 ○_          _-'                            _.'
    ○-                     '-._____.'                      _____..-'
                                                           ━━━━━━━━━━━━━━━━━━━━━━━━━━

S has one inflection, counting a pin; A dips first, 0 bulges off its wall: one inflection more, and one more
direction in which the energy falls. Each kind may go on for extra full periods, two directions each. While
no angle reaches 90° the index of a state with point contacts is the sum of these, less one beyond a fold
(`stability`): at a given load what one sees are mostly states made of S only.

A state is the list of its segments from A to B: U is S S, Ua is S A, UD is S S S, UU is S 0 S; the last one
runs from the wall to end B. In the line regime each arrives at the wall without curvature, and what is left
of the length lies flat. The closed forms are those of `segments`.
"""

import re
from itertools import product
from typing import NamedTuple

import numpy as np

from elastica.ends import Ends, parse_ends
from elastica.pendulum.segments import HALF, Kind
from elastica.spelling import did_you_mean, shown

GRAMMAR = re.compile(
    r"(?P<straight>0)|B(?P<mode>[1-9]\d{0,3})"
    r"|(?P<a>a?)(?P<word>[UD]+)(?P<b>a?)(?P<line>-?)(?::(?P<root>[1-9]\d?))?"
)
MOST_CONTACTS, MOST_ENUMERATED = 50, 10
DASHES = "_−–—"
"""Typed or pasted where a hyphen was meant."""
WALL = {"U": 1, "D": -1}
"""The upper wall and the lower."""
IN_WORDS = {"straight": "0", "flat": "0", "o": "0", "buckled": "B1", "upper": "U", "lower": "D", "line": "U-"}
"""What some would call a state, by what is asked whether they mean it."""


class Segment(NamedTuple):
    """A kind of segment with the heights of its two ends in multiples of H."""

    kind: Kind
    start: int
    end: int

    @property
    def rise(self):
        """Height gained, in multiples of H."""
        return self.end - self.start


class State(NamedTuple):
    """A parsed name: `word` is empty without contact, `mode` is 0 except for B1, B2 and so on."""

    name: str
    mode: int = 0
    word: str = ""
    kind_a: tuple[bool, bool] = (False, False)
    line: bool = False
    root: int = 1

    @property
    def straight(self):
        """Whether this is the straight strip."""
        return not self.mode and not self.word

    @property
    def walls(self):
        """The wall of each contact from end A to end B: 1 for the upper, −1 for the lower."""
        return [WALL[letter] for letter in self.word]

    def segments(self, ends, periods=None):
        """Free segments from end A to end B, each in its rising convention.

        Parameters
        ----------
        ends : str or Ends
        periods : sequence of int, optional
            Extra full periods of each segment.

        Returns
        -------
        tuple of Segment
            Empty for the straight strip.
        """
        ends = parse_ends(ends)
        if self.straight:
            return ()
        if self.mode:
            a, b = ends[::-1] if self.reversed_segments(ends)[0] else ends
            start = -self.mode + HALF * a.pinned
            springs = (np.inf if end.pinned else end.stiffness for end in (a, b))
            return (Segment(Kind(start, 1 - HALF * b.pinned, *springs), 0, 0),)
        first, last = (
            Segment(Kind(HALF - is_a, 1) if end.pinned else Kind(-int(is_a), 1, end.stiffness), 0, 1)
            for end, is_a in zip(ends, self.kind_a, strict=True)
        )
        inner = (
            Segment(Kind(0, 1), -1, 1) if left != right else Segment(Kind(-1, 1), 1, 1)
            for left, right in zip(self.word, self.word[1:], strict=False)
        )
        plain = (first, *inner, last)
        if periods is None:
            return plain
        return tuple(
            segment._replace(kind=segment.kind.extended(extra))
            for segment, extra in zip(plain, periods, strict=True)
        )

    def reversed_segments(self, ends):
        """For each free segment from A to B whether its rising convention runs towards end A.

        Segments are described towards the wall, and without contact towards the clamp: the last one
        leads away from its wall, the free shape of a strip pinned only at B away from its clamp.
        """
        if self.mode:
            ends = parse_ends(ends)
            return (ends.B.pinned and not ends.A.pinned,)
        return (*(False for _ in self.word), True)

    def symmetric(self, ends):
        """Whether the word is its own mirror image, so that one reversal gives the same state."""
        like = parse_ends(ends).alike and self.kind_a[0] == self.kind_a[1]
        return bool(self.word) and like and _from_upper(self.word[::-1]) == self.word


def parse_state(name, ends="clamped-clamped"):
    """Read the name of a state and bring it to its canonical form for these ends.

    Of mirror images the canonical one starts with U and, where both ends are alike, comes last in
    the alphabet of the name and its reversal.

    Parameters
    ----------
    name : str
    ends : str or Ends

    Returns
    -------
    State

    Raises
    ------
    ValueError
        If the name does not follow the grammar or has no meaning for these ends.
    """
    ends = parse_ends(ends)
    match = GRAMMAR.fullmatch(name) if isinstance(name, str) else None
    if match is None:
        raise ValueError(
            f"state = {shown(name)} is not known{_question(name)}; use 0, B1, B2, … or a contact word such "
            "as U, Ua, U-, UD, UD:2"
        )
    if match["straight"]:
        return State("0")
    if match["mode"]:
        return State(f"B{match['mode']}", mode=int(match["mode"]))
    word, kind_a = match["word"], (bool(match["a"]), bool(match["b"]))
    line, root = bool(match["line"]), int(match["root"] or 1)
    if len(word) > MOST_CONTACTS:
        raise ValueError(
            f"state = {shown(name)} has {len(word)} contacts; at most {MOST_CONTACTS} can be solved"
        )
    if line:
        if "UU" in word or "DD" in word:
            raise ValueError(
                f"state = {shown(name)}: a wall touched twice in a row has no line regime; "
                "leave out the '-' or the repeated letter"
            )
        for side, end, is_a in zip("AB", ends, kind_a, strict=True):
            if is_a and end.clamped:
                raise ValueError(
                    f"state = {shown(name)}: at the clamped end {side} a line state has one kind of end "
                    "segment; leave out the 'a'"
                )
    upper = _from_upper(word)
    if ends.alike:
        back = _from_upper(word[::-1])
        images = (upper, kind_a), (back, kind_a[::-1])
        upper, kind_a = max(images, key=lambda image: _spell(*image).casefold())
    spelled = _spell(upper, kind_a) + "-" * line + (f":{root}" if root > 1 else "")
    return State(spelled, word=upper, kind_a=kind_a, line=line, root=root)


def _question(name):
    """Which state was meant by a name that does not follow the grammar."""
    name = str(name).strip()[:MOST_CONTACTS]
    spelled = name.translate({ord(dash): "-" for dash in DASHES}).upper().replace("A", "a")
    spelled = IN_WORDS.get(name.casefold(), spelled)
    return did_you_mean(spelled, [spelled] if GRAMMAR.fullmatch(spelled) else [])


def _from_upper(word):
    return word if word[0] == "U" else word.translate(str.maketrans("UD", "DU"))


def _spell(word, kind_a):
    return "a" * kind_a[0] + word + "a" * kind_a[1]


def states(ends: str | Ends = "clamped-clamped", max_contacts: int = 1) -> list[str]:
    """Canonical names of the states with up to `max_contacts` contacts.

    Parameters
    ----------
    ends : str or Ends
    max_contacts : int
        From 0 to 10; longer words are given by name.

    Returns
    -------
    list of str
        `0`, `B1` … `B(max_contacts + 1)`, then the contact words, point before line regime.

    Raises
    ------
    ValueError
        If `max_contacts` is out of range.
    """
    ends = parse_ends(ends)
    if type(max_contacts) is not int or not 0 <= max_contacts <= MOST_ENUMERATED:
        raise ValueError(f"max_contacts = {max_contacts!r}; use a whole number from 0 to {MOST_ENUMERATED}")
    names = ["0", *(f"B{mode}" for mode in range(1, max_contacts + 2))]
    for contacts in range(1, max_contacts + 1):
        words = ["U" + "".join(rest) for rest in product("UD", repeat=contacts - 1)]
        patterns = product(words, ("", "-"), ("", "a"), ("", "a"))
        names += [a + word + b + line for word, line, a, b in patterns]
    return [name for name in names if is_canonical(name, ends)]


def is_canonical(name, ends):
    """Whether `name` is the canonical name of a state of a strip with these ends."""
    try:
        return parse_state(name, ends).name == name
    except ValueError:
        return False
