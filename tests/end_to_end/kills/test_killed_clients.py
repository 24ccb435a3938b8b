"""A run whose client is killed, before its first block or later, goes on where it was."""

import pytest

pytestmark = pytest.mark.long


def test_the_same_command_goes_on(trial):
    run = trial.begin(2)
    trial.wait(run, least=-0.1)
    trial.kill(run, [run])
    trial.check(run)
