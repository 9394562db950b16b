"""The tables of the measurement store, and how a store of an older version gets them."""

from __future__ import annotations

import sqlite3

APPLICATION_ID = 0x534F534D
"""SQLite application ID that marks a file as a measurement store."""

SCHEMA_VERSION = 3
"""Version 2 added the type of a sensor, the method of a fit and its acceptance in mm. Version 3 keeps the same reading
of another day, and adds withdrawals and what a measurement is known to. An older store is brought up to date when it
is opened."""

_SENSOR = """CREATE TABLE sensor (
        id INTEGER PRIMARY KEY,
        name TEXT NOT NULL UNIQUE,
        clearance_low_mm REAL NOT NULL, clearance_high_mm REAL NOT NULL,
        voltage_low_V REAL NOT NULL, voltage_high_V REAL NOT NULL,
        temperature_low_C REAL NOT NULL, temperature_high_C REAL NOT NULL,
        type TEXT
    ) STRICT"""

_SOURCE = """CREATE TABLE source (
        id INTEGER PRIMARY KEY AUTOINCREMENT,
        sensor INTEGER NOT NULL REFERENCES sensor,
        name TEXT NOT NULL,
        sha256 TEXT NOT NULL
    ) STRICT"""

_MEASUREMENT = """CREATE TABLE measurement (
        id INTEGER PRIMARY KEY AUTOINCREMENT,
        sensor INTEGER NOT NULL REFERENCES sensor,
        source INTEGER NOT NULL REFERENCES source,
        line INTEGER NOT NULL,
        date TEXT NOT NULL,
        clearance_mm REAL NOT NULL, voltage_V REAL NOT NULL, temperature_C REAL NOT NULL,
        sha256 TEXT NOT NULL,
        uncertainty_mm REAL, uncertainty_V REAL, uncertainty_C REAL,
        UNIQUE (source, date, clearance_mm, voltage_V, temperature_C)
    ) STRICT"""

_WITHDRAWAL = """CREATE TABLE withdrawal (
        id INTEGER PRIMARY KEY AUTOINCREMENT,
        source INTEGER NOT NULL UNIQUE REFERENCES source,
        date TEXT NOT NULL,
        author TEXT NOT NULL,
        reason TEXT NOT NULL
    ) STRICT"""

_VERSION = """CREATE TABLE version (
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
        drift_mm REAL,
        method TEXT NOT NULL DEFAULT 'paper',
        type TEXT,
        accept_mm REAL,
        last_withdrawal INTEGER NOT NULL DEFAULT 0,
        PRIMARY KEY (sensor, number)
    ) STRICT"""


def _guards(*tables: str) -> tuple[str, ...]:
    return tuple(
        f"""CREATE TRIGGER {table}_{event.lower()} BEFORE {event} ON {table}
        BEGIN SELECT RAISE(ABORT, 'what is in the store stays as it is'); END"""
        for table in tables
        for event in ("UPDATE", "DELETE")
    )


SCHEMA = (
    _SENSOR,
    _SOURCE,
    _MEASUREMENT,
    _WITHDRAWAL,
    _VERSION,
    *_guards("source", "measurement", "withdrawal", "version"),
)

_TO_2 = (
    "ALTER TABLE sensor ADD COLUMN type TEXT",
    "ALTER TABLE version ADD COLUMN method TEXT NOT NULL DEFAULT 'paper'",
    "ALTER TABLE version ADD COLUMN type TEXT",
    "ALTER TABLE version ADD COLUMN accept_mm REAL",
)

_TO_3 = (
    # A constraint cannot be dropped: each table is copied into a new one, which then takes its name and its numbers.
    # Guards go with the old table.
    _SOURCE.replace("TABLE source", "TABLE new_source"),
    "INSERT INTO new_source SELECT id, sensor, name, sha256 FROM source ORDER BY id",
    "DROP TRIGGER source_delete",
    "DROP TABLE source",
    "ALTER TABLE new_source RENAME TO source",
    _MEASUREMENT.replace("TABLE measurement", "TABLE new_measurement"),
    "INSERT INTO new_measurement SELECT id, sensor, source, line, date, clearance_mm, voltage_V, temperature_C, "
    "sha256, NULL, NULL, NULL FROM measurement ORDER BY id",
    "DROP TRIGGER measurement_delete",
    "DROP TABLE measurement",
    "ALTER TABLE new_measurement RENAME TO measurement",
    _WITHDRAWAL,
    "ALTER TABLE version ADD COLUMN last_withdrawal INTEGER NOT NULL DEFAULT 0",
    *_guards("source", "measurement", "withdrawal"),
)

MIGRATIONS = {1: _TO_2, 2: _TO_3}
"""Statements that make of a store of each version one of the next."""


def bring_up_to_date(connection: sqlite3.Connection) -> None:
    """Bring a store of an older version up to date, inside a transaction and without checks of foreign keys."""
    (version,) = connection.execute("PRAGMA user_version").fetchone()
    for older in range(version, SCHEMA_VERSION):
        for statement in MIGRATIONS[older]:
            connection.execute(statement)
        connection.execute(f"PRAGMA user_version = {older + 1}")
