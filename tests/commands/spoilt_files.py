"""Files spoilt in every way that chance finds: the same seed always spoils the same file in the same way."""

from __future__ import annotations

import io
import json
import math
import re
import sqlite3
import zipfile
from collections.abc import Callable
from contextlib import closing, suppress
from random import Random
from typing import Any

Spoil = Callable[[bytes, Random], bytes]

TOKEN = re.compile(rb'"[^"\n]*"|[-+]?\d[\d.eE+-]*|\w+')
"""A text in quotes, a number or a word, in JSON, TOML, CSV and XML alike."""

ODD_TOKENS = (
    *(b"", b"0", b"-0", b"-1", b"1", b"2.5", b"1e-400", b"1e400", b"-1e308", b"9" * 30, b"9" * 400, b"9" * 5000),
    *(b"1e99999999999999999999", b"NaN", b"nan", b"inf", b"-Infinity", b"true", b"null", b"none", b"2024-03-01"),
    *(
        b'""',
        b'"\xc3\xa9\xf0\x9f\x98\x80"',
        b'"\\ud800"',
        b'"\\u0000"',
        b"\xed\xa0\x80",
        b"\0",
        b'"' + b"x" * 5000 + b'"',
    ),
    *(
        b"[]",
        b"{}",
        b"[[]]",
        b"[1, [2, {}]]",
        b"[" * 20_000,
        b"[" * 500 + b"]" * 500,
        b'{"a":' * 500 + b"1" + b"}" * 500,
    ),
    *(b'"../.."', b'"/"', b'"1/0"', b'"-1/3"', b"0x10", b"1_000", b"\xd9\xa3", b"1,2", b"1;2", b"=1+1", b"#"),
)
"""Numbers, texts and structures that a reader may stumble over."""

ODD_VALUES: tuple[Any, ...] = (
    *(None, True, False, 0, -1, 1, 2.5, 1e308, 1e-300, 10**30, 10**400, float("nan"), float("inf"), "", "x", "1/0"),
    *("\ud800", "\0", "é😀", "x" * 5000, [], {}, [[]], [1, 2, 3], {"a": 1}, {"\ud800": 1}, {"": {}}),
)
"""The same as values of JSON."""

ODD_SQL = (
    *("0", "-1", "1", "2.5", "1e308", "9e999", "''", "'x'", "'[]'", "'[[]]'", "'[[1]]'"),
    *("""'[["0x1p+0"], []]'""", """'[["nan"]]'""", """'[["inf", "0x1p+9999"]]'""", "'{}'", "'null'", "'2024-13-01'"),
    *("CAST(x'ff' AS TEXT)", "CAST(x'eda080' AS TEXT)", "'a' || char(0) || 'b'", "char(10)"),
)
"""Values as SQL writes them."""

ENCODINGS = ("utf-16", "utf-16-le", "utf-32", "latin-1", "utf-8-sig", "cp500")


def spoilt(content: bytes, random: Random) -> bytes:
    """Return `content` spoilt in one way, or in several."""
    for _ in range(random.choice((1, 1, 1, 2, 3))):
        content = random.choice(_WAYS)(content, random)
    return content


def spoilt_workbook(content: bytes, random: Random) -> bytes:
    """Return a workbook with one of its parts spoilt, or the archive itself."""
    if random.random() < 0.3:
        return random.choice(_BYTES)(content, random)
    with zipfile.ZipFile(io.BytesIO(content)) as archive:
        parts = {name: archive.read(name) for name in archive.namelist()}
    name = random.choice([*parts, *[name for name in parts if "sheet" in name or "haredStrings" in name] * 4])
    parts[name] = spoilt(parts[name], random)
    if random.random() < 0.1:
        del parts[name]
    buffer = io.BytesIO()
    with zipfile.ZipFile(buffer, "w", random.choice((zipfile.ZIP_STORED, zipfile.ZIP_DEFLATED))) as archive:
        for name, part in parts.items():
            archive.writestr(name, part)
    return buffer.getvalue()


def spoilt_store(content: bytes, random: Random) -> bytes:
    """Return a SQLite file with an odd value in one place, without one of its tables or columns, or spoilt as bytes."""
    if random.random() < 0.3:
        return random.choice(_BYTES)(content, random)
    with closing(sqlite3.connect(":memory:", isolation_level=None)) as connection:
        connection.deserialize(content)
        for (name,) in connection.execute("SELECT name FROM sqlite_schema WHERE type = 'trigger'").fetchall():
            connection.execute(f"DROP TRIGGER {name}")
        tables = connection.execute("SELECT name FROM sqlite_schema WHERE sql LIKE '%STRICT'").fetchall()
        (table,) = random.choice(tables)
        column = random.choice(connection.execute(f"SELECT name FROM pragma_table_info('{table}')").fetchall())[0]
        value = random.choice(ODD_SQL)
        change = random.choice(
            (
                *(f"UPDATE {table} SET {column} = {value}",) * 4,
                f"UPDATE {table} SET {column} = {value} WHERE rowid = 1",
                f"DELETE FROM {table}",
                f"DROP TABLE {table}",
                f"ALTER TABLE {table} RENAME COLUMN {column} TO other",
                f"PRAGMA user_version = {random.randrange(3)}",
                "PRAGMA application_id = 0",
            )
        )
        with suppress(sqlite3.Error):  # of another type, or the same value where all must differ
            connection.execute(change)
        return connection.serialize()


def _span(content: bytes, random: Random) -> tuple[int, int]:
    start = random.randrange(len(content) + 1)
    return start, min(len(content), start + random.choice((1, 2, 10, 100)))


def _flip(content: bytes, random: Random) -> bytes:
    changed = bytearray(content)
    for _ in range(random.choice((1, 1, 4, 16)) if content else 0):
        changed[random.randrange(len(changed))] ^= 1 << random.randrange(8)
    return bytes(changed)


def _delete(content: bytes, random: Random) -> bytes:
    start, end = _span(content, random)
    return content[:start] + content[end:]


def _repeat(content: bytes, random: Random) -> bytes:
    start, end = _span(content, random)
    return content[:end] + content[start:end] * random.choice((1, 3)) + content[end:]


def _truncate(content: bytes, random: Random) -> bytes:
    return content[: random.choice((0, random.randrange(len(content) + 1)))]


def _insert(content: bytes, random: Random) -> bytes:
    start, _ = _span(content, random)
    return content[:start] + random.choice((b"\0", b"\xff", b"\r", b"\n", b'"', b"\xed\xa0\x80")) + content[start:]


def _recode(content: bytes, random: Random) -> bytes:
    return content.decode("utf-8", "replace").encode(random.choice(ENCODINGS), "replace")


def _replace_token(content: bytes, random: Random) -> bytes:
    tokens = list(TOKEN.finditer(content))
    if not tokens:
        return content
    token = random.choice(tokens)
    other = random.choice((random.choice(ODD_TOKENS), random.choice(tokens)[0], _other_number(token[0], random)))
    return content[: token.start()] + other + content[token.end() :]


def _other_number(token: bytes, random: Random) -> bytes:
    """Return a number near `token` or far from it; other tokens in quotes or out of them."""
    try:
        number = float(token)
    except ValueError:
        return token.strip(b'"') if token.startswith(b'"') else b'"' + token + b'"'
    number *= random.choice((0.5, 2, 10, -1, 1e-3, 1e6, 1e-12, 1e30))
    return (repr(number) if b"." in token or not math.isfinite(number) else str(int(number))).encode()


def _move_line(content: bytes, random: Random) -> bytes:
    """Repeat, delete or swap lines: keys twice, keys missing, keys in the wrong table."""
    lines = content.splitlines(keepends=True)
    if not lines:
        return content
    first, second = (random.randrange(len(lines)) for _ in range(2))
    match random.randrange(3):
        case 0:
            lines.insert(second, lines[first])
        case 1:
            del lines[first]
        case _:
            lines[first], lines[second] = lines[second], lines[first]
    return b"".join(lines)


def _change_json(content: bytes, random: Random) -> bytes:
    """Replace, remove, wrap or rename one value of a JSON text; leave other texts as they are."""
    try:
        tree = json.loads(content)
    except (ValueError, RecursionError):
        return content
    holder: Any = [tree]
    whole, key = holder, 0
    while random.random() < 0.85 and isinstance(holder[key], dict | list) and holder[key]:
        holder = holder[key]
        key = random.choice(list(holder) if isinstance(holder, dict) else range(len(holder)))
    match random.randrange(5):
        case 0:
            del holder[key]
        case 1:
            holder[key] = [holder[key]]
        case 2 if isinstance(holder, dict):
            holder[random.choice(("", "x", "\ud800", "format", "name"))] = holder.pop(key)
        case _:
            alike = [value for value in ODD_VALUES if type(value) is type(holder[key])]
            holder[key] = random.choice(random.choice((ODD_VALUES, alike or ODD_VALUES)))
    return json.dumps(whole[0] if whole else None).encode()


_BYTES: tuple[Spoil, ...] = (_flip, _delete, _repeat, _truncate, _insert)
_WAYS: tuple[Spoil, ...] = (*_BYTES, _recode, *(_replace_token,) * 4, *(_move_line,) * 2, *(_change_json,) * 4)
