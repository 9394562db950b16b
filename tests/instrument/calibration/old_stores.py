"""Stores of older versions, as those versions made them."""

import sqlite3
from contextlib import closing
from pathlib import Path

_TABLES = {
    "sensor": """CREATE TABLE sensor (
        id INTEGER PRIMARY KEY,
        name TEXT NOT NULL UNIQUE,
        clearance_low_mm REAL NOT NULL, clearance_high_mm REAL NOT NULL,
        voltage_low_V REAL NOT NULL, voltage_high_V REAL NOT NULL,
        temperature_low_C REAL NOT NULL, temperature_high_C REAL NOT NULL{type}
    ) STRICT""",
    "source": """CREATE TABLE source (
        id INTEGER PRIMARY KEY AUTOINCREMENT,
        sensor INTEGER NOT NULL REFERENCES sensor,
        name TEXT NOT NULL,
        sha256 TEXT NOT NULL,
        UNIQUE (sensor, sha256)
    ) STRICT""",
    "measurement": """CREATE TABLE measurement (
        id INTEGER PRIMARY KEY AUTOINCREMENT,
        sensor INTEGER NOT NULL REFERENCES sensor,
        source INTEGER NOT NULL REFERENCES source,
        line INTEGER NOT NULL,
        date TEXT NOT NULL,
        clearance_mm REAL NOT NULL, voltage_V REAL NOT NULL, temperature_C REAL NOT NULL,
        sha256 TEXT NOT NULL,
        UNIQUE (sensor, clearance_mm, voltage_V, temperature_C)
    ) STRICT""",
    "version": """CREATE TABLE version (
        sensor INTEGER NOT NULL REFERENCES sensor,
        number INTEGER NOT NULL,
        date TEXT NOT NULL,
        measurements INTEGER NOT NULL,
        last_measurement INTEGER NOT NULL REFERENCES measurement,
        data_sha256 TEXT NOT NULL,
        required_r REAL NOT NULL,
        robust INTEGER NOT NULL,
        coefficients TEXT NOT NULL,
        adjusted_r_squared REAL NOT NULL,
        rms_mm REAL NOT NULL,
        cross_validated_mm REAL,
        drift_mm REAL{method}{type}{accept},
        PRIMARY KEY (sensor, number)
    ) STRICT""",
}


def older(path: Path, version: int, made: Path) -> Path:
    """Write what a store of today holds into a new one of version 1 or 2; sensors' types and methods go with 1."""
    columns = {"type": "", "method": "", "accept": ""}
    if version == 2:
        columns = {
            "type": ", type TEXT",
            "method": ", method TEXT NOT NULL DEFAULT 'paper'",
            "accept": ", accept_mm REAL",
        }
    with closing(sqlite3.connect(path, isolation_level=None)) as store:
        store.execute("ATTACH ? AS today", (str(made),))
        store.execute("BEGIN")
        for table, text in _TABLES.items():
            store.execute(text.format(**columns))
            names = ", ".join(row[1] for row in store.execute(f"PRAGMA main.table_info({table})"))
            store.execute(f"INSERT INTO main.{table} ({names}) SELECT {names} FROM today.{table}")
        for table in ("source", "measurement", "version"):
            for event in ("UPDATE", "DELETE"):
                store.execute(
                    f"CREATE TRIGGER {table}_{event.lower()} BEFORE {event} ON {table} "
                    "BEGIN SELECT RAISE(ABORT, 'what is in the store stays as it is'); END"
                )
        store.execute(f"PRAGMA application_id = {0x534F534D}")
        store.execute(f"PRAGMA user_version = {version}")
        store.execute("COMMIT")
    return path
