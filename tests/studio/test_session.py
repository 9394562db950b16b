"""Sessions of the studio: what follows a change, what is superseded, and that nothing is left behind."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from tests.interface.small import FILTER, INSTRUMENT
from tests.studio.lives import lives
from tests.studio.sessions import TEXT, file_in, proven, session_in, state, until

import sosmith
from sosmith.host.loopback import MessageError
from sosmith.studio.session import MAX_FILE, MAX_TEXT, Session, opened

LONG = {"filter.order": 9, "filter.cutoff": 3.0, "hardware.realization": "auto", "hardware.architecture": "auto"}
"""Changes that take seconds to prove."""
QUICK = {"filter.order": 1, "hardware.realization": "df1", "hardware.architecture": "parallel"}
"""Changes that take next to no time."""


@pytest.fixture(name="session")
def _session(tmp_path: Path) -> Iterator[Session]:
    with session_in(tmp_path) as session:
        yield session


def change(session: Session, changes: dict[str, Any], **more: Any) -> None:
    """Say what a page says when something was changed."""
    session.handle({"do": "change", "changes": changes, **more}, "page")


def test_what_is_shown_is_what_the_interface_computes(session: Session) -> None:
    known = proven(session)
    design = sosmith.design(FILTER)
    preview, proof = known["preview"], known["design"]
    assert (preview["error"], preview["name"], preview["spec"]["filter"]) == (None, "plain", FILTER["filter"])
    (stage,), (shown,) = preview["stages"], proof["stages"]
    assert preview["describe"] == stage["filter"]["describe"] == "Butterworth lowpass, order 2, 100 Hz at 1000 Hz"
    assert np.interp(100.0, stage["response"]["f"], stage["response"]["db"]) == pytest.approx(-3.0103, abs=1e-4)
    assert stage["step"]["y"][-1] == pytest.approx(1.0, abs=0.02)
    assert [complex(*each) for each in stage["plane"]["zeros"]] == [-1, -1]
    assert (proof["bound"], proof["allowed"]) == (float(design.bound), float(design.specification.max_error))
    assert dict(proof["budget"]) == {part: float(value) for part, value in design.budget.items()}
    assert (proof["realization"], proof["architecture"]) == ("df1_ef1", "parallel")
    gain = 20 * np.log10(abs(design.frequency_response(shown["f"])))
    assert shown["db"][:-1] == pytest.approx(gain[:-1].tolist(), abs=1e-3)
    assert list(proof["scenarios"]) == list(design.scenarios)


def test_a_change_is_answered_and_proven(session: Session) -> None:
    proven(session)
    change(session, {"filter.cutoff": 123.0}, n=7)
    known = proven(session)
    assert (known["preview"]["client"], known["preview"]["n"]) == ("page", 7)
    assert known["preview"]["stages"][0]["filter"]["cutoff"] == (123.0,)
    assert known["document"]["text"] == TEXT.replace("cutoff = 100.0", "cutoff = 123.0")
    assert known["document"]["saved"] is False
    made = sosmith.design(sosmith.Specification.from_toml(known["document"]["text"]))
    assert known["design"]["bound"] == float(made.bound)


def test_ten_quick_changes_leave_no_work_behind(session: Session) -> None:
    seen = set(session.processes)
    for k in range(9):
        change(session, LONG | {"filter.cutoff": 3.0 + k})
        seen |= set(session.processes)
        assert len(session.processes) <= 3
    assert session.busy
    change(session, QUICK | {"filter.cutoff": 99.0})
    known = proven(session)
    assert len(seen) >= 9
    assert [pid for pid in seen if pid not in session.processes and lives(pid)] == []
    assert (known["design"]["realization"], known["preview"]["stages"][0]["filter"]["order"]) == ("df1", 1)
    kept = session.processes
    session.close()
    assert session.processes == []
    assert [pid for pid in kept if lives(pid)] == []


def test_while_a_handle_is_dragged_nothing_is_proven(session: Session) -> None:
    proven(session)
    change(session, LONG)
    working = set(session.processes)
    change(session, {"filter.cutoff": 5.0}, moving=True)
    known = until(session, lambda known: known["preview"]["spec"]["filter"]["cutoff"] == 5.0 and not session.busy)
    assert known["proof"]["state"] == "waiting"
    assert not session.busy
    assert len([pid for pid in working if lives(pid)]) == 1  # the one for previews
    change(session, QUICK | {"filter.cutoff": 5.0})
    assert proven(session)["design"]["realization"] == "df1"


def test_a_wrong_specification_is_told_as_the_command_line_tells_it(session: Session) -> None:
    proven(session)
    change(session, {"filter.cutoff": 600.0})
    known = until(session, lambda known: known["preview"]["error"] is not None and known["proof"]["state"] == "refused")
    with pytest.raises(sosmith.SpecificationError) as refused:
        sosmith.Specification.load(FILTER | {"filter": FILTER["filter"] | {"cutoff": 600.0}})
    told = str(refused.value).removeprefix("specification: ")
    assert known["preview"]["error"].endswith(told)
    assert known["proof"]["error"].endswith(told)
    assert known["preview"]["spec"]["filter"]["cutoff"] == 100.0  # the last good one is still shown
    session.handle({"do": "text", "text": "name = "}, "page")
    known = until(session, lambda known: "TOML" in (known["preview"]["error"] or ""))
    assert "line 1 must be valid TOML, not a syntax error: invalid value" in known["preview"]["error"]
    change(session, {"filter.cutoff": 10.0})  # there is nothing to change it in
    assert state(session)["document"]["text"] == "name = "
    session.handle({"do": "text", "text": TEXT}, "page")
    assert proven(session)["preview"]["error"] is None


@pytest.mark.parametrize(
    ("typed", "told"),
    [
        (f"cutoff = 1{'0' * 400}", "filter.cutoff must be a number"),
        (f"sample_rate = 1{'0' * 400}", "sample_rate must be a number"),
        ("passband_edge = []\nstopband_edge = []\npassband_loss = 1\nstopband_loss = 9", "passband_edge must be "),
    ],
)
def test_a_number_that_is_none_of_ours_outlasts_the_form(session: Session, typed: str, told: str) -> None:
    """What is typed as text is there when the form is changed next."""
    key = typed.partition(" ")[0]
    rest = [line for line in TEXT.splitlines() if not line.startswith((f"{key} ", "cutoff ", "order "))]
    place = 0 if key == "sample_rate" else rest.index("[filter]") + 1
    text = "\n".join([*rest[:place], typed, *(["order = 2"] * (key == "cutoff")), *rest[place:]])
    session.handle({"do": "text", "text": text}, "page")
    change(session, {"filter.kind": "bandpass"})
    known = until(session, lambda known: known["proof"]["state"] == "refused" and not session.busy)
    assert known["document"]["text"] == text
    assert told in known["proof"]["error"]


@pytest.mark.parametrize(
    ("table", "named"),
    [
        ("calibration]\ndata", "calibration.data"),
        ("filter]\nsos_file", "filter.sos_file"),
        ("[stage]]\ntaps_file", "stage[0].taps_file"),
    ],
)
@pytest.mark.parametrize("place", ["/etc/passwd", "../secret.csv"])
def test_a_text_names_no_file_outside_its_folder(session: Session, table: str, named: str, place: str) -> None:
    session.handle({"do": "text", "text": f'[{table} = "{place}"\n'}, "page")
    known = until(session, lambda known: known["preview"]["error"] is not None and not session.busy)
    told = f"{named} must be a file in the folder of the specification, not '{place}'"
    assert known["preview"]["error"].endswith(told)
    assert known["proof"]["error"].endswith(told)


def test_saving_asks_before_it_replaces_what_it_has_not_read(session: Session, tmp_path: Path) -> None:
    file = tmp_path / "plain.toml"
    change(session, {"filter.cutoff": 90.0})
    session.handle({"do": "save"}, "page")
    assert file.read_text() == TEXT.replace("cutoff = 100.0", "cutoff = 90.0")
    assert state(session)["document"]["saved"] is True
    file.write_text("# somebody else's\n" + TEXT)
    change(session, {"filter.cutoff": 80.0})
    session.handle({"do": "save"}, "page")
    document = state(session)["document"]
    assert document["question"] == "plain.toml has changed on the disk since it was read. Overwrite it?"
    assert file.read_text().startswith("# somebody else's")
    session.handle({"do": "save", "overwrite": True}, "page")
    assert file.read_text() == TEXT.replace("cutoff = 100.0", "cutoff = 80.0")
    file.write_text("# somebody else's\n" + TEXT)
    session.handle({"do": "reread"}, "page")
    assert (state(session)["document"]["text"], state(session)["document"]["saved"]) == (file.read_text(), True)


def test_a_file_that_cannot_be_written_is_told(session: Session, tmp_path: Path) -> None:
    (tmp_path / "plain.toml").unlink()
    (tmp_path / "plain.toml").mkdir()
    session.handle({"do": "save", "overwrite": True}, "page")
    assert (
        state(session)["document"]["problem"] == f"{tmp_path}/plain.toml: the output file must be a file, not a folder"
    )


def test_without_a_file_the_example_is_opened_and_replaces_nothing(tmp_path: Path) -> None:
    scratch = tmp_path / "scratch"
    scratch.mkdir()
    target = file_in(tmp_path)
    session = opened(None, target, scratch)
    try:
        assert state(session)["document"]["text"] == sosmith.Specification.example().toml()
        session.handle({"do": "save"}, "page")
        assert state(session)["document"]["question"] == "There is a plain.toml already. Overwrite it?"
        assert target.read_text() == TEXT
    finally:
        session.close()


def test_a_file_that_cannot_be_read_is_refused(tmp_path: Path) -> None:
    missing = tmp_path / "none.toml"
    with pytest.raises(
        sosmith.SpecificationError, match=r"none\.toml: the specification must be a readable file, not: no such"
    ):
        opened(missing, None, tmp_path)
    with pytest.raises(sosmith.SpecificationError, match=rf"must be at most {MAX_TEXT} characters, not longer$"):
        opened(file_in(tmp_path, "#" * (MAX_TEXT + 1)), None, tmp_path)


def test_realizations_come_one_after_another(session: Session) -> None:
    session.handle({"do": "realizations", "on": True}, "page")
    known = until(session, lambda known: known["realizations"]["state"] == "done")
    rows = {row["realization"]: row for row in known["realizations"]["rows"]}
    assert tuple(rows) == sosmith.Specification.load(FILTER).realizations
    made = sosmith.design(FILTER, realization="delta")
    assert (rows["delta"]["bound"], rows["delta"]["cost"]["luts"]) == (float(made.bound), made.estimates[0].luts)
    change(session, {"output.max_error": 0.00099})
    assert state(session)["realizations"]["rows"] == []
    session.handle({"do": "realizations", "on": False}, "page")
    assert state(session)["realizations"] == {"state": "off", "rows": []}


def test_a_trace_is_run_on_the_integer_model(session: Session) -> None:
    design = sosmith.design(FILTER)
    proven(session)
    session.handle({"do": "trace", "source": "noise", "seconds": 2.0}, "page")
    found = until(session, lambda known: known["trace"]["state"] == "done")["trace"]
    inputs = design.trace("noise", seconds=2.0).inputs
    error = design.run(**inputs) - design.run_exact(**inputs)
    assert (found["samples"], found["max_error"]) == (2000, float(abs(error).max()))
    (channel,) = found["channels"]
    assert max(channel["error"]) == pytest.approx(found["max_error"], rel=1e-6)
    assert len(found["t"]) == 400
    assert found["max_error"] <= found["bound"]
    change(session, {"filter.cutoff": 90.0})
    assert state(session)["trace"]["old"] is True


def test_a_trace_of_two_channels(session: Session) -> None:
    csv = "time_s,channel,x\n" + "".join(
        f"{k / 1000},{channel},{value}\n" for k in range(200) for channel, value in enumerate((0.5, -0.25))
    )
    change(session, {"channels": 2, "hardware.architecture": "folded"})
    proven(session)
    session.handle({"do": "trace", "source": "", "csv": csv}, "page")
    found = until(session, lambda known: known["trace"]["state"] in {"done", "refused"})["trace"]
    ends = [channel["high"][-1] for channel in found["channels"]]
    assert ends == pytest.approx([0.5, -0.25], abs=0.002)
    assert max(max(channel["error"]) for channel in found["channels"]) == pytest.approx(found["max_error"], rel=1e-6)


def test_a_dropped_trace_is_run_after_the_proof(session: Session) -> None:
    csv = "time_s,x\n" + "".join(f"{k / 1000},{0.5 if k > 20 else 0}\n" for k in range(200))
    change(session, {"filter.cutoff": 110.0})
    session.handle({"do": "trace", "source": "", "csv": csv}, "page")
    found = until(session, lambda known: known["trace"]["state"] in {"done", "refused"})["trace"]
    assert (found["state"], found["samples"]) == ("done", 200)
    assert found["channels"][0]["high"][-1] == pytest.approx(0.5, abs=0.002)
    session.handle({"do": "trace", "source": "", "csv": "a,b\n1,2\n"}, "page")
    found = until(session, lambda known: known["trace"]["state"] == "refused")["trace"]
    assert "x" in found["error"]


def test_measurements_become_the_calibration(tmp_path: Path) -> None:
    voltage, temperature = (grid.ravel() for grid in np.meshgrid(np.linspace(0, 10, 6), np.linspace(20, 90, 4)))
    clearance = 1.2 + 0.4 * voltage + 0.06 * voltage**2 - 0.003 * temperature
    rows = zip(clearance, voltage, temperature, strict=True)
    csv = "clearance_mm,voltage_V,temperature_C\n" + "".join(f"{d:.6f},{v:.6f},{T:.6f}\n" for d, v, T in rows)
    with session_in(tmp_path, sosmith.Specification.load(INSTRUMENT).toml()) as session:
        session.handle({"do": "calibration", "csv": csv}, "page")
        known = until(session, lambda known: known["calibration"]["state"] in {"done", "refused"})
        found = known["calibration"]
        (tmp_path / "measurements.csv").write_text(csv)
        fitted = sosmith.Calibration.load(tmp_path / "measurements.csv")
        assert (found["measurements"], found["orders"], found["rms"]) == (24, [*fitted.orders], float(fitted.rms))
        assert 0 < found["half_width"][0] < found["half_width"][1] < 2
        assert found["coefficients"] == fitted.coefficients
        made = sosmith.Specification.from_toml(state(session)["document"]["text"]).as_dict()
        assert made["calibration"] == {"coefficients": found["coefficients"]}
        session.handle({"do": "calibration", "csv": "a,b\n"}, "page")
        found = until(session, lambda known: known["calibration"]["state"] == "refused")["calibration"]
        assert found["error"].startswith("measurements.csv, line 1: column must be one of clearance_mm, voltage_V, ")


@pytest.mark.parametrize(
    "message",
    [
        None,
        [],
        {},
        {"do": "exit"},
        {"do": "change"},
        {"do": "change", "changes": [1]},
        {"do": "text", "text": "#" * (MAX_TEXT + 1)},
        {"do": "trace", "source": "/etc/passwd"},
        {"do": "trace", "source": "noise", "seconds": "1"},
        {"do": "calibration", "csv": 3},
        {"do": "calibration", "csv": "," * (MAX_FILE + 1)},
        {"do": "realizations", "on": "yes"},
        {"do": "realizations", "on": True, "stage": -1},
        {"do": "stages"},
        {"do": "stages", "what": "add", "kind": "biquad", "at": 0},
        {"do": "stages", "what": "move", "at": 0, "to": -1},
        {"do": "stages", "what": "remove", "at": "0"},
    ],
)
def test_what_no_page_says_is_refused(session: Session, message: Any) -> None:
    with pytest.raises(MessageError):
        session.handle(message, "page")


@pytest.mark.parametrize(
    "changes",
    [
        {"filter.order.x": 1},
        {"name.x.y": 1},
        {"sample_rate": "x", "filter.order": 3},
        {"filter": 1, "filter.order": 2},
        {"filter.passband_edge": [None]},
        {"sample_rate": 10**400, "filter.order": 1},
        {"stage.0.order": 1},
    ],
    ids=str,
)
def test_changes_that_cannot_be_made_leave_the_text_as_it_is(session: Session, changes: dict[str, Any]) -> None:
    before = state(session)["document"]["text"]
    session.handle({"do": "change", "n": 1, "changes": changes}, "page")
    assert state(session)["document"]["text"] == before
