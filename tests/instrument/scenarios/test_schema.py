"""Refusals of scenario files: file, key, what would be right, what was found."""

from __future__ import annotations

import re
from pathlib import Path

import pytest
from tests.instrument.scenarios.scenario_texts import CALIBRATION, FAULT, PLAIN

from sosmith.instrument.scenarios.file import load_scenario
from sosmith.model.errors import SpecificationError

EXCERPT_KEYS = (
    "day, operation, seconds, temperature, temperature_to, time_constant, clearances, motion, motion_from, vibration, "
    "fault"
)


def changed(old: str, new: str, text: str = PLAIN) -> str:
    assert old in text
    return text.replace(old, new, 1)


@pytest.mark.parametrize(
    ("text", "message"),
    [
        (
            changed("seconds = 60", "second = 60"),
            f"excerpt[0].second must be one of the keys {EXCERPT_KEYS}, not an unknown one (did you mean seconds?)",
        ),
        (
            changed("[wear]", "[wears]"),
            "wears must be one of the keys description, start, sensors, wear, channel, "
            "calibration, excerpt, not an unknown one (did you mean wear?)",
        ),
        (changed("noise = 0.01", ""), "sensors.inductive.noise must be a number of V from 0 to 10, not missing"),
        (
            changed("noise = 0.01", "noise = true"),
            "sensors.inductive.noise must be a number of V from 0 to 10, not true",
        ),
        (
            changed("noise = 0.01", 'noise = "0.01"'),
            "sensors.inductive.noise must be a number of V from 0 to 10, not '0.01'",
        ),
        (changed("noise = 0.01", "noise = -1"), "sensors.inductive.noise must be a number of V from 0 to 10, not -1"),
        (changed("noise = 0.01", "noise = nan"), "sensors.inductive.noise must be a number of V from 0 to 10, not nan"),
        (
            changed("noise = 0.01", 'noise = 0.01\nmodel = "linear"'),
            "sensors.inductive.model must be one of equation_4, equation_5a, coil, not 'linear'",
        ),
        (
            changed("noise = 0.01", "noise = 0.01\noutput_range = [10, 0]"),
            "sensors.inductive.output_range must be rising, [low, high], not [10.0, 0.0]",
        ),
        (
            changed("noise = 0.01", "noise = 0.01\nmains = { amplitudes = [0.1, -0.1] }"),
            "sensors.inductive.mains.amplitudes must be a list of 0 to 40 numbers of V from 0 to 10, "
            "not one with -0.1 at [1]",
        ),
        (
            changed("noise = 4.0", "noise = 4.0\ndigitizer = { bits = 16.5 }"),
            "sensors.thermocouple.digitizer.bits must be a whole number from 2 to 32, not 16.5",
        ),
        (
            changed('operation = "depot"', 'operation = "yard"'),
            "excerpt[0].operation must be one of bench, depot, tangent, curve, braking, not 'yard'",
        ),
        (
            changed("temperature = 20.0", "temperature = 500"),
            "excerpt[0].temperature must be a number of degC from -40 to 400, not 500",
        ),
        (
            changed("temperature = 20.0", "temperature = 20.0\nclearances = [1, 0]"),
            "excerpt[0].clearances must be a list of 1 to 1000 numbers of mm from 0.01 to 25, not one with 0 at [1]",
        ),
        (
            changed("temperature = 20.0", "temperature = 20.0\ntime_constant = 5.0"),
            "excerpt[0].time_constant must be given only together with temperature_to, not 5.0",
        ),
        (
            changed("temperature = 20.0", "temperature = 20.0\nvibration = 0.1"),
            "excerpt[0].vibration must be left out where operation is depot, not 0.1",
        ),
        (
            changed('"depot"', '"curve"\nclearances = [1, 2]'),
            "excerpt[0].clearances must be left out where operation is curve, not [1.0, 2.0]",
        ),
        (
            changed('"depot"', '"curve"\nmotion = [[1, 2]]\nmotion_from = "vehicle"'),
            "excerpt[0].motion_from must be left out where motion is given, not 'vehicle'",
        ),
        (
            changed('"depot"', '"curve"\nmotion = [[1, 2], [0, 1]]'),
            "excerpt[0].motion must be a list of pairs [frequency in Hz, amplitude in mm], not one with 0 at [1][0]",
        ),
        (
            changed("rate = 0.1", ""),
            "wear must be given by one of rate, rate_per_1000_km and history, not none of them",
        ),
        (
            changed("rate = 0.1", "rate = 0.1\nhistory = [[0, 1], [1, 2]]"),
            "wear must be given by one of rate, rate_per_1000_km and history, not rate, history",
        ),
        (
            changed("rate = 0.1", "rate_per_1000_km = 0.1"),
            "wear.km_per_day must be given if and only if rate_per_1000_km is given, not missing",
        ),
        (
            changed("rate = 0.1", "history = [[1, 1], [1, 2]]"),
            "wear.history must be a list of pairs with rising days, not [1.0, 1.0]",
        ),
        (
            changed("[wear]\ninitial_clearance = 2.0\nrate = 0.1", ""),
            "excerpt[0].clearances must be given where there is no [wear], not missing",
        ),
        (
            changed("[[excerpt]]", "[[channel]]\ninitial_clearance = 1.0\nrate = 0\n[[excerpt]]"),
            "channel must be left out where [wear] is given, not a list of 1 values",
        ),
        (
            changed("[sensors", "start = 9999-01-01\n[sensors"),
            "start must be a date up to 9900-01-24, so that every day has a date, not 9999-01-01",
        ),
        (PLAIN.partition("[[excerpt]]")[0], "excerpt must be at least one table [[excerpt]], not missing"),
        (changed('"a test"', '""'), "description must be a text of 1 to 200 characters, not ''"),
        (
            changed("[sensors", 'start = "2024-03-01"\n[sensors'),
            "start must be a date such as 2024-03-01, that of day 0, not '2024-03-01'",
        ),
        (
            PLAIN + FAULT.replace('"stuck"', '"open"'),
            "excerpt[0].fault[0].kind must be missing or stuck for the inductive sensor, not 'open'",
        ),
        (
            PLAIN + FAULT.replace('"stuck"', '"missing"'),
            'excerpt[0].fault[0].share must be given if and only if kind is "missing", not missing',
        ),
        (
            PLAIN + FAULT + "share = 0.5\n",
            'excerpt[0].fault[0].share must be given if and only if kind is "missing", not 0.5',
        ),
        (
            PLAIN + FAULT.replace('"stuck"', '"missing"\nshare = 0.5\ncode = 3'),
            'excerpt[0].fault[0].code must be given only if kind is "stuck", not 3',
        ),
        (
            PLAIN + CALIBRATION.replace("scatter = 0.3", "scatter = 0.0"),
            "calibration.repeats must be 1 where scatter is 0, not 4",
        ),
        (
            PLAIN + CALIBRATION.replace("[2, 5, 8]", "[2, 5, 5]"),
            "calibration.clearances must be a list without repetition, not [2.0, 5.0, 5.0]",
        ),
        (
            changed("noise = 0.01", "noise = -1").replace("noise = 4.0", "noise = -1"),
            "sensors.inductive.noise must be a number of V from 0 to 10, not -1 (and 1 more)",
        ),
        (
            "description = 'a",
            "line 1 must end its text with the quote that begins it",
        ),
    ],
)
def test_refusals(tmp_path: Path, text: str, message: str) -> None:
    path = tmp_path / "day.toml"
    path.write_text(text, encoding="utf-8")
    with pytest.raises(SpecificationError, match=f"^{re.escape(f'{path}: {message}')}$"):
        load_scenario(path)


def test_files_that_are_no_text(tmp_path: Path) -> None:
    missing = tmp_path / "none.toml"
    with pytest.raises(
        SpecificationError, match=r"none.toml: the file must be a readable file, not: no such file or directory$"
    ):
        load_scenario(missing)
    missing.write_bytes(b"a = 1\nb = '\xff'\n")
    with pytest.raises(SpecificationError, match=r"none.toml: line 2 must be UTF-8 text, not the byte 0xff$"):
        load_scenario(missing)
    missing.write_bytes(b"#" * (1 << 19))
    with pytest.raises(SpecificationError, match=r"none.toml: the file must be at most 262144 bytes, not longer$"):
        load_scenario(missing)


def test_whole_numbers_are_numbers(tmp_path: Path) -> None:
    path = tmp_path / "day.toml"
    path.write_text(changed("noise = 0.01", "noise = 1"), encoding="utf-8")
    assert load_scenario(path).sensors.inductive.noise == 1.0
