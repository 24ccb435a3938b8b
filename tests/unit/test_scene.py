import numpy as np
import pytest

from elastica.control import CONTROLS, LOAD, SHORTENING, read_control
from elastica.ends import parse_ends
from elastica.scene import Scene
from elastica.state import parse_state

ENDS = parse_ends("clamped-pinned")


@pytest.mark.parametrize(
    "state, rises",
    [("U", (1, 1)), ("UD", (1, 2, 1)), ("UU", (1, 0, 1)), ("aUDDa", (1, 2, 0, 1)), ("B2", (0,))],
)
def test_segments_rise_by_the_distance_of_what_they_join(state, rises):
    scene = Scene(ENDS, np.array([0.3, 0.07]))
    segments = parse_state(state, ENDS).segments(ENDS)
    for segment, rise in zip(segments, rises, strict=True):
        np.testing.assert_array_equal(scene.rise(segment), rise * scene.H)
        np.testing.assert_array_equal(
            scene.height(segment.start) + scene.rise(segment), scene.height(segment.end)
        )


def test_distinct_scenes_are_told_where_they_stand():
    scene = Scene(ENDS, np.array([0.2, 0.1, 0.2]))
    once, which = scene.distinct()
    assert once.H.tolist() == [0.1, 0.2]
    np.testing.assert_array_equal(once.at(which).H, scene.H)
    assert once.ends is scene.ends


def test_a_control_is_found_by_its_name():
    assert CONTROLS == {"P": LOAD, "shortening": SHORTENING}
    assert read_control(2.0, None) == (LOAD, 2.0)
    assert read_control(None, 0.1) == (SHORTENING, 0.1)
