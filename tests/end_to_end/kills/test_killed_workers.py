"""A run one of whose workers is killed finishes."""

import pytest
from end_to_end.kills.trials import workers_of

pytestmark = pytest.mark.long


def test_the_run_outlives_it(trial):
    run = trial.begin(2)
    trial.wait(run, least=1 / trial.whole.blocks)
    trial.kill(run, workers_of(run))
    said = trial.check(run)
    assert run.returncode == 0, said
