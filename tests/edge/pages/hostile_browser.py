"""A browser, or a stranger, that lies to a page: requests of no page of ours, and messages of none."""

from __future__ import annotations

import json
import os
import random
import socket
import struct
from collections.abc import Callable

Chance = random.Random

TEXTS = ("", "x", "\x1b[2J", "a.b", "filter", "name", "../../x", "=1+1", "9" * 400, "[" * 300, "\u202e", "None", "nan")
NUMBERS = (0, -1, 1, 0.5, 1e-300, 1e308, -1e308, 2**31, 2**63, 10**30, float("inf"), float("nan"), True)
KEYS = (
    *("name", "sample_rate", "filter", "filter.order", "filter.cutoff", "filter.family", "filter.kind", "input.x.bits"),
    *("output.max_error", "hardware.realization", "calibration.data", "..", "", "a" * 300, "filter.order.x"),
)
DO = ("change", "text", "save", "reread", "realizations", "trace", "stop", "calibration")


def requests(address: str, rng: Chance) -> bytes:
    """Return the bytes of a request that must not be answered with a page, nor with a websocket."""
    port, token = address.split(":")[2].split("/")[:2]
    return rng.choice(_REQUESTS)(port, token, rng)


def _get(place: str, *headers: str, method: str = "GET", version: str = "HTTP/1.1") -> bytes:
    lines = [f"{method} {place} {version}", *headers, "", ""]
    return "\r\n".join(lines).encode("latin-1", "replace")


def _other_host(port: str, token: str, rng: Chance) -> bytes:
    names = (
        *("evil.example", "[::1]", "[::ffff:127.0.0.1]", "127.1", "0x7f.1", "2130706433", "127.0.0.1.", "LOCALHOST."),
        *("localhost.evil.example", "user@127.0.0.1", "127.0.0.1:1", "", " ", "0.0.0.0", "127.0.0.2", "[::]", "\xe9"),
    )
    host = f"Host: {rng.choice(names)}:{port}"
    return _get(f"/{token}/{rng.choice(('', 'live', 'report'))}", *rng.choice(([host], [host] * 2, [])))


def _other_origin(port: str, token: str, rng: Chance) -> bytes:
    own = f"http://127.0.0.1:{port}"
    origin = rng.choice(
        (
            "null",
            "https://x",
            f"{own}.x",
            own.replace("http", "https"),
            "",
            f"{own}/",
            own + " ,x",
            f"http://[::1]:{port}",
        )
    )
    more = [f"Origin: {own}"] if rng.random() < 0.3 else []
    return _get(f"/{token}/live", f"Host: 127.0.0.1:{port}", *more, f"Origin: {origin or 'x'}", *_UPGRADE)


def _other_place(port: str, token: str, rng: Chance) -> bytes:
    place = rng.choice(
        (
            *("/", "//", "*", "/live", f"/{token}", f"/{token[:-1]}/", f"/{token}x/", f"/{token}/../", f"/{token}/%2e"),
            *(
                f"/{token}/live?",
                f"/{token}//",
                f"http://x/{token}/",
                f"/{token}/" + "a" * 9000,
                "/%00",
                "/" + "../" * 99,
            ),
            *(f"/{token.lower()}/", f"/{token.swapcase()}/live", f"\\{token}\\", f"/{token}/report/", "/\t", ""),
        )
    )
    return _get(place, f"Host: 127.0.0.1:{port}", *(_UPGRADE if rng.random() < 0.3 else ()))


def _other_method(port: str, token: str, rng: Chance) -> bytes:
    method = rng.choice(("POST", "PUT", "HEAD", "OPTIONS", "TRACE", "CONNECT", "get", "", "G" * 9000, "PRI"))
    version = rng.choice(("HTTP/1.1", "HTTP/1.0", "HTTP/0.9", "HTTP/2.0", "x"))
    wrong = method if version in {"HTTP/1.1", "HTTP/1.0"} else "GET"
    return _get(f"/{token}/", f"Host: 127.0.0.1:{port}", method=wrong, version=version)


def _body(port: str, token: str, rng: Chance) -> bytes:
    """Return a request with a body, by its length, in chunks, or by both, which some take for the next request."""
    host = f"Host: 127.0.0.1:{port}"
    kinds = (
        ("Content-Length: 5",),
        ("Content-Length: 99999999999999999999",),
        ("Content-Length: -1",),
        ("Content-Length: 0", "Content-Length: 7"),
        ("Transfer-Encoding: chunked",),
        ("Transfer-Encoding: chunked", "Content-Length: 0"),
        ("Transfer-Encoding: identity, chunked",),
    )
    body = rng.choice((b"0\r\n\r\n", b"5\r\nhello\r\n0\r\n\r\n", b"ffffffffffffffff\r\n", b"hello", rng.randbytes(50)))
    return _get(f"/{token}/", host, *rng.choice(kinds), method=rng.choice(("GET", "POST"))) + body


def _headers(port: str, token: str, rng: Chance) -> bytes:
    """Return a request whose headers are too many, too long, or none."""
    host = f"Host: 127.0.0.1:{port}"
    lines = rng.choice(
        (
            [f"A{n}: b" for n in range(rng.choice((129, 1000)))],
            ["A: " + "b" * rng.choice((8200, 100_000))],
            ["A\0: b"],
            ["A : b"],
            [": b"],
            ["no colon"],
            ["A: b\x01"],
            ["A\xe9: b"],
        )
    )
    return _get(f"/{token}/", host, *lines)


def _noise(port: str, token: str, rng: Chance) -> bytes:
    return rng.choice(
        (
            rng.randbytes(rng.choice((1, 100, 3000))) + b"\r\n\r\n",
            b"\x16\x03\x01\x02\x00\x01\x00\x01\xfc\x03\x03" + rng.randbytes(200),
            b"PRI * HTTP/2.0\r\n\r\nSM\r\n\r\n",
            b"\r\n" * rng.choice((1, 50)),
            b"\n" * 20_000,
            b"GET",
            b"",
            _get(f"/{token}/", f"Host: 127.0.0.1:{port}")[: rng.randint(1, 20)],
        )
    )


def _bad_upgrade(port: str, token: str, rng: Chance) -> bytes:
    """Return a request for the websocket that is none."""
    lines = list(_UPGRADE)
    if rng.random() < 0.5:
        del lines[rng.randrange(3)]
    else:
        lines[2] = rng.choice(("Sec-WebSocket-Key: x", "Sec-WebSocket-Key: " + "A" * 900, "Sec-WebSocket-Key:"))
    return _get(f"/{token}/live", f"Host: 127.0.0.1:{port}", *lines)


_UPGRADE = (
    "Connection: Upgrade",
    "Upgrade: websocket",
    "Sec-WebSocket-Key: dGhlIHNhbXBsZSBub25jZQ==",
    "Sec-WebSocket-Version: 13",
)
_REQUESTS: tuple[Callable[[str, str, Chance], bytes], ...] = (
    _other_host,
    _other_origin,
    _other_place,
    _other_method,
    _body,
    _headers,
    _noise,
    _bad_upgrade,
)


def opened(address: str) -> socket.socket:
    """Open a websocket by hand, past its handshake."""
    port, token = address.split(":")[2].split("/")[:2]
    made = socket.create_connection(("127.0.0.1", int(port)), timeout=60)
    made.sendall(_get(f"/{token}/live", f"Host: 127.0.0.1:{port}", *_UPGRADE))
    head = b""
    while b"\r\n\r\n" not in head:
        part = made.recv(4096)
        assert part, f"the handshake must be answered, not {head!r}"
        head += part
    assert head.startswith(b"HTTP/1.1 101 "), head
    return made


def frame(opcode: int, body: bytes, *, masked: bool = True, fin: bool = True, length: int | None = None) -> bytes:
    """Return a frame of RFC 6455, or what only looks like one."""
    size = len(body) if length is None else length
    first = (0x80 if fin else 0) | opcode
    mark = 0x80 if masked else 0
    if size < 126:
        head = struct.pack("!BB", first, mark | size)
    elif size < 1 << 16:
        head = struct.pack("!BBH", first, mark | 126, size)
    else:
        head = struct.pack("!BBQ", first, mark | 127, size)
    if not masked:
        return head + body
    mask = os.urandom(4)
    return head + mask + bytes(byte ^ mask[n % 4] for n, byte in enumerate(body))


def frames(rng: Chance) -> bytes:
    """Return frames that no browser sends."""
    return rng.choice(
        (
            frame(1, b"{}", masked=False),
            frame(rng.choice((3, 7, 11, 15, 0x41, 0x71)), b"x"),
            frame(1, b"x", length=1 << 62),
            frame(2, b"x", length=(1 << 63) + 5),
            frame(1, b"\xff\xfe"),
            frame(0, b"x"),
            frame(1, b"a", fin=False) + frame(1, b"b"),
            frame(9, b"x" * 126),
            frame(9, b"x", fin=False),
            frame(8, b"\x03"),
            frame(8, struct.pack("!H", rng.choice((0, 999, 1005, 1016, 5000))) + b"\xff"),
            rng.randbytes(rng.choice((2, 30, 400))),
        )
    )


def message(rng: Chance) -> str | bytes:
    """Return a message that no page of ours sends; most are refused at once, some ask for work that is none."""
    kind = rng.randrange(10)
    if kind == 0:
        return rng.choice((b"\xff\x00", "[" * 100_000, "9" * 5000, "", "{", "NaN", "\ud7ff", b"\0" * 1000, '{"do"'))
    if kind == 1:
        return json.dumps(_value(rng, 3))
    if kind == 2:
        return json.dumps({"do": _value(rng, 2), "n": _value(rng, 1)})
    made = {"do": rng.choice(DO)}
    for key in ("n", "changes", "text", "source", "seconds", "csv", "on", "report", "moving", "overwrite"):
        if rng.random() < 0.6:
            made[key] = _value(rng, 2)
    if kind == 3 and rng.random() < 0.4:
        made |= {"do": "change", "n": 1, "changes": {rng.choice(KEYS): _value(rng, 1) for _ in range(2)}}
    return json.dumps(made)


def _value(rng: Chance, deep: int) -> object:
    kind = rng.randrange(6 if deep else 3)
    if kind == 0:
        return rng.choice(NUMBERS)
    if kind == 1:
        return rng.choice((*TEXTS, "\ud800"))
    if kind == 2:
        return None
    if kind == 3:
        return [_value(rng, deep - 1) for _ in range(rng.randint(0, 2))]
    return {rng.choice((*KEYS, "do")): _value(rng, deep - 1) for _ in range(rng.randint(0, 3))}
