"""A run whose scheduler is killed says so and goes on without it."""

import pytest
from end_to_end.processes import ByHand, witnessed

pytestmark = pytest.mark.long


@pytest.fixture
def by_hand(tmp_path):
    with ByHand(tmp_path, **witnessed(tmp_path / "witness")) as by_hand:
        by_hand.worker(), by_hand.worker()
        yield by_hand


def test_the_loss_is_told_and_the_same_command_goes_on(trial, by_hand):
    trial.environment |= by_hand.environment
    run = trial.begin(by_hand.address)
    trial.wait(run, least=1 / trial.whole.blocks)
    trial.kill(run, [by_hand.scheduler])
    said = trial.check(run)
    assert run.returncode == 0 or "the scheduler was lost" in said.splitlines()[-1]
