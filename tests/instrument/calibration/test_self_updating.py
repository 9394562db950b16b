"""The self-updating calibration: what goes into the store stays, whatever happens, and fits come out the same."""

from __future__ import annotations

import random
import re
import signal
import sqlite3
import struct
import subprocess
import sys
import time
from collections.abc import Iterator
from contextlib import closing
from pathlib import Path

import pytest
from tests.instrument.calibration.measuring import readings, write_csv
from tests.instrument.calibration.old_stores import older

from sosmith.gen.calibration.fit import fit, read_measurements
from sosmith.instrument.calibration.calibration_report import measurements_csv
from sosmith.instrument.calibration.measurement_store import MeasurementStore, Withdrawal, open_store
from sosmith.instrument.calibration.self_updating import add, calibration_of, find_version, refit
from sosmith.instrument.calibration.sensor_type import SENSOR_TYPES
from sosmith.instrument.calibration.store.withdrawing import withdraw
from sosmith.model.errors import ShortfallError, SpecificationError, ToolError
from sosmith.model.polynomial import EQUATION_5A, Polynomial
from sosmith.verify.specified.calibration_fit import check_fit

DAY = "2024-03-01"
ROOT = Path(__file__).parents[3]


@pytest.fixture
def store(tmp_path: Path) -> Iterator[MeasurementStore]:
    with open_store(tmp_path / "c.db", create=True) as opened:
        yield opened


def batch(folder: Path, name: str, count: int = 40, seed: int = 1, scatter: float = 0.05) -> Path:
    return write_csv(folder / name, readings(count, scatter, seed))


def test_every_addition_makes_a_version_fitted_to_everything(store: MeasurementStore, tmp_path: Path) -> None:
    for seed in (1, 2, 3):
        addition = add(store, "left", batch(tmp_path, f"{seed}.csv", seed=seed), f"2024-03-0{seed}", required_r=0.999)
        assert addition.kept
        assert addition.calibration is not None
        assert addition.calibration.new
    versions = store.versions("left")
    assert [(one.number, one.date, one.measurements) for one in versions] == [
        (1, "2024-03-01", 40),
        (2, "2024-03-02", 80),
        (3, "2024-03-03", 120),
    ]
    assert len({one.data_sha256 for one in versions}) == 3
    assert versions[0].drift is None
    newest = calibration_of(store, "left")
    assert newest.drift.keys() == {1, 2}
    assert versions[2].drift == newest.drift[2] > 0
    assert newest.fit.orders == (2, 1)
    assert [one.source for one in newest.stored[::40]] == [str(tmp_path / f"{seed}.csv") for seed in (1, 2, 3)]


def test_drift_shows_a_sensor_that_has_changed(store: MeasurementStore, tmp_path: Path) -> None:
    add(store, "left", batch(tmp_path, "a.csv", 20), DAY, required_r=0.999)
    (first, *others), *rows = EQUATION_5A.coefficients
    aged = Polynomial(((first + 1, *others), *rows))  # 1 mm
    addition = add(store, "left", write_csv(tmp_path / "b.csv", readings(180, 0.05, 2, aged)), DAY, required_r=0.99)
    assert addition.calibration is not None
    assert addition.calibration.version.drift == pytest.approx(0.9, abs=0.15)


def test_sensors_are_apart(store: MeasurementStore, tmp_path: Path) -> None:
    path = batch(tmp_path, "a.csv")
    for sensor in ("left", "right"):
        addition = add(store, sensor, path, DAY)
        assert addition.kept
    assert store.sensors() == ["left", "right"]
    assert [store.versions(sensor)[-1].number for sensor in store.sensors()] == [1, 1]


def test_bad_rows_keep_the_file_out_unless_the_user_says_so(store: MeasurementStore, tmp_path: Path) -> None:
    path = batch(tmp_path, "a.csv")
    path.write_text(path.read_text() + "1,2,three\n")
    for keep_good in (False, True):
        addition = add(store, "left", path, DAY, keep_good=keep_good)
        assert [one.line for one in addition.file.refusals] == [42]
        assert addition.kept == keep_good
        assert len(store.measurements("left")) == (40 if keep_good else 0)


def test_what_is_there_already_is_refused(store: MeasurementStore, tmp_path: Path) -> None:
    path = batch(tmp_path, "a.csv")
    add(store, "left", path, DAY)
    message = f"{path} must hold new measurements, not those already added as {path}"
    with pytest.raises(SpecificationError, match=f"^{re.escape(message)}$"):
        add(store, "left", path, "2024-03-02")
    header, first, *_ = path.read_text().splitlines()
    other = tmp_path / "b.csv"
    other.write_text(f"{header}\n{first}\n1,1.5,30\n")
    addition = add(store, "left", other, DAY)
    assert not addition.kept
    reason = f"row must be a new measurement, not a duplicate of measurement 1 ({path}, line 2, {DAY})"
    assert [(one.line, one.reason) for one in addition.file.refusals] == [(2, reason)]


def test_the_same_reading_on_another_day_is_a_measurement(store: MeasurementStore, tmp_path: Path) -> None:
    add(store, "left", batch(tmp_path, "a.csv"), DAY)
    header, first, *_ = (tmp_path / "a.csv").read_text().splitlines()
    other = tmp_path / "b.csv"
    other.write_text(f"{header},date\n{first},2024-03-02\n{first},2024-03-03\n{first},2024-03-03\n")
    addition = add(store, "left", other, DAY, keep_good=True)
    assert [(one.line, one.reason) for one in addition.file.refusals] == [
        (4, "row must be a new measurement, not a duplicate of line 3")
    ]
    assert [one.reading.date for one in store.measurements("left")[40:]] == ["2024-03-02", "2024-03-03"]
    exported = tmp_path / "exported.csv"
    exported.write_text(measurements_csv(store.measurements("left")))
    made = find_version(store, "left").polynomial
    assert fit(read_measurements(exported)).polynomial == made
    assert check_fit(exported.read_bytes(), made.coefficients).rows == 42


def test_a_withdrawn_file_counts_no_more_and_stays(store: MeasurementStore, tmp_path: Path) -> None:
    first = add(store, "left", batch(tmp_path, "a.csv"), DAY, required_r=0.999).calibration
    wrong = write_csv(tmp_path / "b.csv", [(d + 0.5, V, T) for d, V, T in readings(40, seed=2)])
    second = add(store, "left", wrong, "2024-03-02", required_r=0.99).calibration
    assert first is not None
    assert second is not None
    gone = withdraw(store, "left", str(wrong), "2024-03-03", "A. Smith", "wrong gauge")
    assert gone.source.withdrawal == Withdrawal(1, "2024-03-03", "A. Smith", "wrong gauge")
    assert gone.calibration is not None
    assert gone.calibration.version.polynomial == first.version.polynomial
    assert (gone.calibration.version.required_r, gone.calibration.version.measurements) == (0.99, 40)
    assert [one.withdrawal is None for one in store.sources("left")] == [True, False]
    for number in (1, 2, 3):
        assert calibration_of(store, "left", number).version == store.versions("left")[number - 1]
    message = f"{wrong} must be a file that counts, not one that A. Smith withdrew on 2024-03-03"
    with pytest.raises(SpecificationError, match=f"^{re.escape(message)}$"):
        withdraw(store, "left", str(wrong), "2024-03-04", "A. Smith", "again")
    again = add(store, "left", wrong, "2024-03-02", required_r=0.99)  # after all
    assert again.kept
    assert again.calibration is not None
    assert again.calibration.version.polynomial == second.version.polynomial
    assert not refit(store, "left", DAY, required_r=0.99).new
    gone = withdraw(store, "left", "3", "2024-03-03", "A. Smith", "for good")
    gone = withdraw(store, "left", "1", "2024-03-03", "A. Smith", "all of it")
    assert gone.calibration is None
    assert gone.shortfall == f"{store.path}, sensor left must hold a file that counts, not none"


@pytest.mark.parametrize(
    ("given", "message"),
    [
        ({"name": "c.csv"}, "{path}: the file must be one of {folder}/a.csv, or its number, not c.csv"),
        ({"author": " "}, "the author must be printable text, not ' '"),
        ({"reason": "a\nb"}, "the reason must be printable text, not 'a\\nb'"),
        ({"sensor": "right"}, "{path}: the sensor must be one of left, not right"),
    ],
)
def test_refused_withdrawals(store: MeasurementStore, tmp_path: Path, given: dict[str, str], message: str) -> None:
    add(store, "left", batch(tmp_path, "a.csv"), DAY)
    asked = {"sensor": "left", "name": "1", "date": DAY, "author": "A. Smith", "reason": "wrong"} | given
    text = message.format(path=store.path, folder=tmp_path)
    with pytest.raises(SpecificationError, match=f"^{re.escape(text)}$"):
        withdraw(store, **asked)
    assert store.sources("left")[0].withdrawal is None


SLIPS = {
    "inches": (lambda d, V, T: (d / 25.4, V, T), "clearance_mm must be in millimetres, not in inches"),
    "centimetres": (lambda d, V, T: (d / 10, V, T), "clearance_mm must be in millimetres, not in centimetres"),
    "swapped": (lambda d, V, T: (V, d, T), "clearance_mm and voltage_V must be in their own columns, not swapped"),
}


@pytest.mark.parametrize("slip", SLIPS)
def test_a_slip_within_the_ranges_is_found_by_the_version_before(
    store: MeasurementStore, tmp_path: Path, slip: str
) -> None:
    add(store, "left", batch(tmp_path, "a.csv", 100), DAY, required_r=0.999)
    changed, sentence = SLIPS[slip]
    rows = [changed(*row) for row in readings(12, seed=2)]
    path = write_csv(tmp_path / "b.csv", rows)
    with pytest.raises(SpecificationError) as caught:
        add(store, "left", path, DAY, keep_good=True)
    assert re.fullmatch(
        re.escape(f"{path}: {sentence}")
        + r": the rms residual against version 1 is \d\.\d+ mm as it is, and 0\.0\d+ mm with that undone; "
        r"--surprising stores them as they are",
        str(caught.value),
    )
    assert len(store.measurements("left")) == 100
    assert add(store, "left", path, DAY, surprising=True).kept


def test_ranges_stay_with_the_sensor(store: MeasurementStore, tmp_path: Path) -> None:
    path = write_csv(tmp_path / "a.csv", [(d, V, T - 40) for d, V, T in readings(40)])
    assert not add(store, "left", path, DAY).kept
    assert store.ranges("left") is None
    assert add(store, "left", path, DAY, ranges=(None, None, (-40.0, 85.0))).kept
    assert store.ranges("left") == ((0.0, 16.0), (0.0, 10.0), (-40.0, 85.0))
    more = write_csv(tmp_path / "b.csv", [(d, V, T - 40) for d, V, T in readings(40, seed=2)])
    assert add(store, "left", more, DAY).kept


def test_too_few_measurements_are_kept_until_there_are_enough(store: MeasurementStore, tmp_path: Path) -> None:
    addition = add(store, "left", batch(tmp_path, "a.csv", 3), DAY)
    assert (addition.kept, addition.calibration) == (True, None)
    assert addition.shortfall == (
        f"{store.path}, sensor left must hold at least 4 measurements for a linear regression, not 3"
    )
    with pytest.raises(ShortfallError, match=f"^{re.escape(addition.shortfall)}$"):
        refit(store, "left", DAY)
    message = f"{store.path}: sensor left must have a fitted version, not only measurements"
    with pytest.raises(SpecificationError, match=f"^{re.escape(message)}$"):
        find_version(store, "left")
    assert add(store, "left", batch(tmp_path, "b.csv", seed=2), DAY).calibration is not None


def test_a_refit_makes_a_version_only_if_anything_changed(store: MeasurementStore, tmp_path: Path) -> None:
    add(store, "left", batch(tmp_path, "a.csv"), DAY)
    same = refit(store, "left", "2024-04-01")
    assert (same.new, same.version) == (False, find_version(store, "left", 1))
    higher = refit(store, "left", "2024-04-01", required_r=0.999)
    assert (higher.new, higher.version.number, higher.fit.orders) == (True, 2, (2, 1))
    robust = refit(store, "left", "2024-04-01", required_r=0.999, robust=True)
    assert (robust.version.number, robust.version.robust) == (3, True)


def test_refits_from_the_store_are_the_same_to_the_bit(store: MeasurementStore, tmp_path: Path) -> None:
    made = []
    for seed, robust in ((1, False), (2, True), (3, False)):
        addition = add(store, "left", batch(tmp_path, f"{seed}.csv", seed=seed), DAY, required_r=0.99, robust=robust)
        assert addition.calibration is not None
        made.append(addition.calibration.version)
    for version in made:
        again = calibration_of(store, "left", version.number)
        assert again.version == version
        assert again.version.polynomial.coefficients == version.polynomial.coefficients


@pytest.mark.slow
def test_a_process_that_takes_the_processor_for_an_older_one_finds_the_same_bits(
    store: MeasurementStore, tmp_path: Path
) -> None:
    add(store, "left", batch(tmp_path, "a.csv", 500), DAY, required_r=0.9999 - 0.001)
    script = (
        "import sys; from pathlib import Path\n"
        "from sosmith.instrument.calibration.measurement_store import open_store\n"
        "from sosmith.instrument.calibration.self_updating import calibration_of\n"
        "with open_store(Path(sys.argv[1])) as store: calibration_of(store, 'left')\n"
    )
    environment = {
        "OPENBLAS_NUM_THREADS": "1",
        "OPENBLAS_CORETYPE": "Prescott",
        "NPY_DISABLE_CPU_FEATURES": "AVX2 FMA3",
    }
    subprocess.run([sys.executable, "-c", script, store.path], env=environment, check=True, timeout=600)


def tamper(path: Path, statement: str) -> None:
    """Change the file behind the back of the store, whose triggers would refuse."""
    connection = sqlite3.connect(path)
    (trigger, text) = connection.execute(
        "SELECT name, sql FROM sqlite_schema WHERE type = 'trigger' AND name = ?", (statement.split()[1] + "_update",)
    ).fetchone()
    with connection:
        connection.execute(f"DROP TRIGGER {trigger}")
        connection.execute(statement)
        connection.execute(text)
    connection.close()


def test_a_changed_measurement_and_a_changed_version_are_noticed(store: MeasurementStore, tmp_path: Path) -> None:
    add(store, "left", batch(tmp_path, "a.csv"), DAY)
    tamper(store.path, "UPDATE version SET coefficients = replace(coefficients, '0x1.', '0x1.0')")
    with pytest.raises(
        ShortfallError, match=r"^version 1 of sensor left must be reproducible, not give another polynomial$"
    ):
        calibration_of(store, "left")
    tamper(store.path, "UPDATE measurement SET voltage_V = voltage_V + 0.001 WHERE id = 7")
    message = f"{store.path}: measurement 7 must match its stored hash, not differ from it"
    with pytest.raises(SpecificationError, match=f"^{re.escape(message)}$"):
        store.measurements("left")


@pytest.mark.parametrize("statement", ["DELETE FROM {}", "UPDATE {} SET date = '2000-01-01'"])
@pytest.mark.parametrize("table", ["measurement", "version", "withdrawal"])
def test_what_is_in_the_store_stays_as_it_is(
    statement: str, table: str, store: MeasurementStore, tmp_path: Path
) -> None:
    add(store, "left", batch(tmp_path, "a.csv"), DAY)
    withdraw(store, "left", "1", DAY, "A. Smith", "wrong")
    connection = sqlite3.connect(store.path)
    with pytest.raises(sqlite3.IntegrityError, match=r"^what is in the store stays as it is$"):
        connection.execute(statement.format(table))
    connection.close()


@pytest.mark.slow
def test_10000_measurements_are_refitted(store: MeasurementStore, tmp_path: Path) -> None:
    add(store, "left", batch(tmp_path, "a.csv", 10_000, scatter=0.3), DAY)
    made = refit(store, "left", DAY, required_r=0.99)
    assert made.new
    assert made.fit.orders == (2, 1)


ADDING = """
import sys
from pathlib import Path
from sosmith.instrument.calibration.measurement_store import open_store
from sosmith.instrument.calibration.self_updating import add
store, folder, first, last = Path(sys.argv[1]), Path(sys.argv[2]), int(sys.argv[3]), int(sys.argv[4])
print("ready", flush=True)
for k in range(first, last):
    with open_store(store, create=True) as opened:
        add(opened, "left", folder / f"{k}.csv", "2024-03-01", required_r=0.9)
    print(k, flush=True)
"""


def adding(path: Path, folder: Path, first: int, last: int, before: str = "", *more: str) -> subprocess.Popen[str]:
    """Start a process that adds the files ``<first>.csv`` up to but for ``<last>.csv``, and says so after each."""
    arguments = [sys.executable, "-c", before + ADDING, str(path), str(folder), str(first), str(last), *more]
    return subprocess.Popen(arguments, stdout=subprocess.PIPE, text=True)


# Other files, other programs.


def opening(path: Path, message: str, kind: type[Exception] = SpecificationError, *, create: bool = False) -> None:
    with pytest.raises(kind, match=f"^{re.escape(str(path) + message)}$"), open_store(path, create=create):
        pass


def tables_of(path: Path) -> dict[str, list[tuple[object, ...]]]:
    """Everything by its name: columns of tables, in the order of their names, since those that were added come last."""
    with closing(sqlite3.connect(path)) as connection:
        names = [name for (name,) in connection.execute("SELECT name FROM sqlite_schema ORDER BY name")]
        return {name: sorted(row[1:] for row in connection.execute(f"PRAGMA table_info({name})")) for name in names}


@pytest.mark.sweep(1)
@pytest.mark.parametrize("version", [1, 2])
def test_an_older_store_is_brought_up_to_date(tmp_path: Path, version: int) -> None:
    with open_store(tmp_path / "made.db", create=True) as store:
        made = add(store, "left", write_csv(tmp_path / "a.csv", readings(60)), "2024-03-01").calibration
    assert made is not None
    path = older(tmp_path / "c.db", version, tmp_path / "made.db")
    with open_store(path) as store:
        assert calibration_of(store, "left").version == made.version
        assert [one.number for one in store.measurements("left")] == [*range(1, 61)]
        other = refit(store, "left", "2024-03-01", method="bayes", sensor_type=SENSOR_TYPES["equation_4"])
        assert other.version.sensor_type == store.sensor_type("left") == SENSOR_TYPES["equation_4"]
        store.check()
    with open_store(path) as store:
        assert [one.method for one in store.versions("left")] == ["paper", "bayes"]
        assert calibration_of(store, "left").version == other.version
        addition = add(store, "left", write_csv(tmp_path / "b.csv", readings(60)[:8]), "2024-03-02")
        assert addition.kept
        assert store.measurements("left")[-1].number == 68
    assert tables_of(path) == tables_of(tmp_path / "made.db")


@pytest.mark.parametrize(
    ("column", "value"), [("date", "x"), ("method", "guess"), ("type", "{}"), ("accept_mm", "wide")]
)
def test_a_spoilt_version_is_refused(tmp_path: Path, column: str, value: str) -> None:
    path = tmp_path / "c.db"
    with open_store(path, create=True) as store:
        add(store, "left", write_csv(tmp_path / "a.csv", readings(60)), "2024-03-01")
    with sqlite3.connect(path) as connection:
        connection.execute("DROP TRIGGER version_update")
        connection.execute("PRAGMA writable_schema = ON")
        connection.execute("UPDATE sqlite_schema SET sql = replace(sql, 'STRICT', '') WHERE name = 'version'")
    connection.close()
    with sqlite3.connect(path) as connection:
        connection.execute(f"UPDATE version SET {column} = ?", (value,))
    connection.close()
    text = re.escape(f"{path} must be an undamaged store, not one with the value ") + ".*"
    with open_store(path) as store, pytest.raises(SpecificationError, match=f"^{text}$"):
        store.versions("left")


def test_files_that_are_no_store(tmp_path: Path) -> None:
    path = tmp_path / "c.db"
    opening(path, " must be an existing store of measurements; sosmith calibrate add creates one")
    opening(
        tmp_path, ": the store must be readable and writable, not: unable to open database file", ToolError, create=True
    )
    path.write_text("clearance_mm,voltage_V,temperature_C\n" * 100)
    opening(path, ": the file must be a store of measurements, not another kind of file")
    path.unlink()
    with sqlite3.connect(path) as connection:
        connection.execute("CREATE TABLE other (a)")
    connection.close()
    opening(path, " must be a store of measurements, not another SQLite database", create=True)
    path.unlink()
    with open_store(path, create=True):
        pass
    with sqlite3.connect(path) as connection:
        connection.execute("PRAGMA user_version = 4")
    connection.close()
    opening(path, ": the store's schema must be version 3, not 4")


def test_a_damaged_store_is_noticed(store: MeasurementStore, tmp_path: Path) -> None:
    add(store, "left", batch(tmp_path, "a.csv", 400), DAY)
    store.check()
    content = store.path.read_bytes()
    voltage = store.measurements("left")[7].reading.values[1]
    assert content.count(struct.pack(">d", voltage)) == 2  # in the table and in its index
    damaged = tmp_path / "damaged.db"
    damaged.write_bytes(content.replace(struct.pack(">d", voltage), struct.pack(">d", voltage + 1), 1))
    pattern = r"^.*damaged\.db must be an undamaged store, not: .*sqlite_autoindex_measurement_1.*$"
    with open_store(damaged) as opened, pytest.raises(SpecificationError, match=pattern):
        opened.check()
    damaged.write_bytes(content[: len(content) // 2])
    pattern = r"^.*damaged\.db: the file must be undamaged, not: .*$"
    with pytest.raises(SpecificationError, match=pattern), open_store(damaged) as opened:
        opened.measurements("left")


def shown(value: str) -> str:
    return f" must be an undamaged store, not one with the value {value}"


VALUES = {
    "half a row": ("version", "coefficients", "'[[]]'", shown("'[[]]'")),
    "no JSON": ("version", "coefficients", "'x'", shown("'x'")),
    "no list": ("version", "coefficients", "'[1]'", shown("'[1]'")),
    "an infinity": ("version", "coefficients", "'[[\"inf\"]]'", shown("""'[["inf"]]'""")),
    "beyond any double": ("version", "coefficients", "'[[\"0x1p+9999\"]]'", shown("""'[["0x1p+9999"]]'""")),
    "an endless range": ("sensor", "voltage_high_V", "9e999", shown("'inf'")),
    "no UTF-8": (
        "sensor",
        "name",
        "CAST(x'ff' AS TEXT)",
        ": the file must be undamaged, not: Could not decode to UTF-8 column 'name' with text '\ufffd'",
    ),
}


@pytest.mark.parametrize(("table", "column", "value", "message"), VALUES.values(), ids=VALUES)
def test_values_that_no_store_holds(
    table: str, column: str, value: str, message: str, store: MeasurementStore, tmp_path: Path
) -> None:
    add(store, "left", batch(tmp_path, "a.csv"), DAY)
    changed(store.path, f"UPDATE {table} SET {column} = {value}")
    with pytest.raises(SpecificationError, match=f"^{re.escape(str(store.path) + message)}$"):
        read_whole(store.path)


def read_whole(path: Path) -> None:
    with open_store(path) as opened:
        for sensor in opened.sensors():
            opened.ranges(sensor)
            opened.versions(sensor)
            opened.measurements(sensor)


def test_a_store_without_a_column(store: MeasurementStore, tmp_path: Path) -> None:
    add(store, "left", batch(tmp_path, "a.csv"), DAY)
    changed(store.path, "ALTER TABLE version RENAME COLUMN rms_mm TO other")
    message = f"{store.path}: the file must be undamaged, not: no such column: rms_mm"
    with pytest.raises(SpecificationError, match=f"^{re.escape(message)}$"):
        read_whole(store.path)


def test_the_first_complaint_about_a_damaged_store_is_one_line(store: MeasurementStore, tmp_path: Path) -> None:
    add(store, "left", batch(tmp_path, "a.csv", 400), DAY)
    damaged = tmp_path / "damaged.db"
    content = bytearray(store.path.read_bytes())
    content[-4096 + 10] = 0x7F  # in the last page: where its second cell stands
    damaged.write_bytes(content)
    pattern = r"^[^\n]*damaged\.db must be an undamaged store, not: [^\n]+\Z"
    with open_store(damaged) as opened, pytest.raises(SpecificationError, match=pattern):
        opened.check()


def changed(path: Path, statement: str) -> None:
    """Change a store by force, without its triggers."""
    with closing(sqlite3.connect(path)) as connection:
        for (name,) in connection.execute("SELECT name FROM sqlite_schema WHERE type = 'trigger'").fetchall():
            connection.execute(f"DROP TRIGGER {name}")
        connection.execute(statement)
        connection.commit()


def test_a_writer_that_waits_in_vain_says_so(
    store: MeasurementStore, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("sosmith.instrument.calibration.measurement_store.PATIENCE", 0.05)
    message = f"{store.path}: the store must be free within a minute, not locked by another program"
    refused = pytest.raises(ToolError, match=f"^{re.escape(message)}$")
    with store.transaction(), refused, open_store(store.path) as other:
        add(other, "left", batch(tmp_path, "a.csv"), DAY)


@pytest.mark.slow
def test_concurrent_writers_lose_nothing(tmp_path: Path) -> None:
    path, each = tmp_path / "c.db", 10
    for k in range(3 * each):
        batch(tmp_path, f"{k}.csv", 10, seed=k)
    writers = [adding(path, tmp_path, each * k, each * (k + 1)) for k in range(3)]
    assert [writer.wait(120) for writer in writers] == [0, 0, 0]
    for writer in writers:
        assert writer.stdout is not None
        writer.stdout.close()
    with open_store(path) as opened:
        opened.check()
        assert len(opened.measurements("left")) == 3 * each * 10
        assert [one.number for one in opened.versions("left")] == list(range(1, 3 * each + 1))
        assert [one.measurements for one in opened.versions("left")] == list(range(10, 301, 10))
        for number in (1, 7, 30):
            calibration_of(opened, "left", number)


# Killed in the middle.

AT_STATEMENT = """
import os, signal, sqlite3, sys
real, count = sqlite3.connect, int(sys.argv[5])
def connect(*arguments, **options):
    connection = real(*arguments, **options)
    def trace(statement):
        global count
        count -= 1
        if count == 0:
            os.kill(os.getpid(), signal.SIGKILL)
    connection.set_trace_callback(trace)
    connection.execute("PRAGMA cache_size = 1")  # so that pages go to the file before the end
    return connection
sqlite3.connect = connect
"""


def whole_batches(path: Path, size: int) -> int:
    """Check a store after a kill; return how many files it holds, each of `size` rows with its version."""
    with open_store(path, create=True) as opened:
        opened.check()
        if not opened.sensors():
            return 0
        stored, versions = opened.measurements("left"), opened.versions("left")
        assert len(stored) == size * len(versions)
        assert [one.measurements for one in versions] == [size * k for k in range(1, len(versions) + 1)]
        if versions:
            calibration_of(opened, "left")
        return len(versions)


@pytest.mark.slow
@pytest.mark.parametrize(
    "statements", [(20, 36, 10_000), pytest.param((1, 8, 14, 18, 22, 26, 36, 10_000), marks=pytest.mark.slow)]
)
def test_killed_at_any_statement_of_an_addition(statements: tuple[int, ...], tmp_path: Path) -> None:
    size = 12
    for k in range(2):
        batch(tmp_path, f"{k}.csv", size, seed=k)
    outcomes, journals = [], 0
    for statement in statements:
        path = tmp_path / f"{statement}.db"
        with open_store(path, create=True) as opened:
            add(opened, "left", tmp_path / "0.csv", DAY, required_r=0.9)
        killed = adding(path, tmp_path, 1, 2, AT_STATEMENT, str(statement))
        said, _ = killed.communicate(timeout=600)
        committed = said.splitlines().count("1")
        journals += Path(f"{path}-journal").exists()
        found = whole_batches(path, size)
        assert found >= 1 + committed
        outcomes.append((killed.returncode, found))
    assert set(outcomes) == {(-signal.SIGKILL, 1), (0, 2)}
    assert journals > len(statements) // 3  # the kill came when part of the addition was in the file already


def kill_while_adding(folder: Path, times: int) -> None:
    """Kill a process that adds files, again and again on the same store; what it said was added must be there."""
    size, generator, done, torn = 10, random.Random(1), 0, 0
    path = folder / "c.db"
    files = 1000 if times > 20 else 300
    for k in range(files):
        batch(folder, f"{k}.csv", size, seed=k)
    for _ in range(times):
        with adding(path, folder, done, files) as process:
            assert process.stdout is not None
            assert process.stdout.readline() == "ready\n"
            time.sleep(generator.uniform(0.0, 0.15))
            process.kill()
            said = [int(line) for line in process.stdout.read().split()]
        torn += Path(f"{path}-journal").exists()
        found = whole_batches(path, size)
        assert found >= (said[-1] + 1 if said else done)
        done = found
    assert done > times / 10
    if times >= 100:
        assert torn > 0


@pytest.mark.slow
def test_killed_ten_times_at_random(tmp_path: Path) -> None:
    kill_while_adding(tmp_path, 10)


@pytest.mark.slow
def test_killed_a_hundred_times_at_random(tmp_path: Path) -> None:
    kill_while_adding(tmp_path, 100)


def test_without_a_transaction_a_kill_would_tear_an_addition(tmp_path: Path) -> None:
    size = 12
    for k in range(2):
        batch(tmp_path, f"{k}.csv", size, seed=k)
    path = tmp_path / "c.db"
    with open_store(path, create=True) as opened:
        add(opened, "left", tmp_path / "0.csv", DAY, required_r=0.9)
    broken = (
        "import contextlib\nfrom sosmith.instrument.calibration.measurement_store import MeasurementStore\n"
        "MeasurementStore.transaction = lambda self: contextlib.nullcontext()\n"
    )
    adding(path, tmp_path, 1, 2, AT_STATEMENT + broken, "30").communicate(timeout=600)
    with pytest.raises(AssertionError):
        whole_batches(path, size)
