"""Alarms over a broker that is killed again and again, a few in every run."""

import random
from pathlib import Path

from tests.suite.extras import needed

needed("paho.mqtt.client")

from tests.edge.hostile_alarms import published  # noqa: E402


def test_no_alarm_is_lost_by_a_broker_that_is_killed(tmp_path: Path) -> None:
    told = published(tmp_path, 40, random.Random(1))
    assert told.findings == ()
    assert told.kills > 1
