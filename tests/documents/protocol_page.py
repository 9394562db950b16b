"""The generated parts of docs/protocol.md: tables, and bytes from the codec and the model of the board."""

import json
import re
from fractions import Fraction

from tests.interface.small import instrument_design

from sosmith.gen.output.identity import identity
from sosmith.model.converters.spi_converter import ReadingFault
from sosmith.model.errors import LinkError
from sosmith.model.link import identity as gate
from sosmith.model.link.device import Device
from sosmith.model.link.frames import Message
from sosmith.model.link.identity import Identity
from sosmith.model.link.integer_core import IntegerCore
from sosmith.model.link.packing import Packing
from sosmith.model.link.protocol import (
    LAYOUTS,
    LINE_BITS,
    MAX_BODY,
    VERSION,
    Counter,
    Status,
    Type,
    samples_per_message,
)
from sosmith.model.port import Port

_PART = re.compile(r"<!-- (?P<what>[a-z]+) -->\n.*?<!-- end of (?P=what) -->", re.DOTALL)


def with_parts(text: str) -> str:
    """Renew what is generated in `text`, which is the page."""
    parts = {
        "frame": _frame,
        "requests": _requests,
        "statuses": _statuses,
        "identity": _identity,
        "ranges": _ranges,
        "refused": _refused,
        "stray": _stray,
        "counters": _counters,
        "readings": _readings,
        "session": _session,
        "packed": _packed,
        "throughput": _throughput,
    }

    def renewed(part: re.Match[str]) -> str:
        return f"<!-- {part['what']} -->\n{parts[part['what']]()}<!-- end of {part['what']} -->"

    return _PART.sub(renewed, text)


def _board() -> tuple[Identity, Device]:
    core = instrument_design().core
    made = identity(core, "module gauge; endmodule", baud=1_000_000, clock=12e6)
    return made, Device(made, IntegerCore(core.datapath, core.spec.channels))


def _hex(data: bytes) -> str:
    return data.hex(" ").upper()


def _frame() -> str:
    message = Message(Type.SAMPLES, 5, bytes([0, 0x12, 0x00, 0x34]))
    return "    message      " + _hex(message.checked) + "\n    on the line  " + _hex(message.frame) + "\n"


def _readings() -> str:
    rows = [f"| {fault.value} | `{fault.name}` | {fault.meaning} |\n" for fault in ReadingFault]
    return "| bit | fault | |\n|---|---|---|\n" + "".join(rows)


def _requests() -> str:
    rows = [
        f"| {kind.value} | `{kind.name}` | {layout.request} | {layout.response} | {layout.text} |\n"
        for kind, layout in LAYOUTS.items()
    ]
    return (
        "| type | | body of the request | body of the response, before the status | |\n|---|---|---|---|---|\n"
        + "".join(rows)
    )


def _statuses() -> str:
    rows = [f"| {status.value} | `{status.name}` | {status.meaning} |\n" for status in Status]
    return "| status | | meaning |\n|---|---|---|\n" + "".join(rows)


def _counters() -> str:
    rows = [f"| {counter.value} | `{counter.name}` | {counter.meaning} |\n" for counter in Counter]
    return "| byte | counter | counts |\n|---|---|---|\n" + "".join(rows)


def _identity() -> str:
    made, _ = _board()
    return f"```json\n{json.dumps(made.model_dump(mode='json', exclude={'results'}))}\n```\n"


def _ranges() -> str:
    name = f"a letter or underscore, then letters, digits and underscores; {gate.MAX_NAME} characters at most"
    whole = "1 to 4294967295"
    rows = {
        "`protocol`": str(VERSION),
        "`name`, `core`, `architecture`, names of inputs, output and flags": name,
        "`sosmith`": f"1 to {gate.MAX_NAME} letters, digits and `.+_-`",
        "`design`": "64 hexadecimal digits, small letters",
        "`channels`": "1 to 256",
        "`sample_rate`, `clock`": f"{gate.MIN_RATE:g} to {gate.MAX_RATE:g} Hz",
        "`baud`, `words` of `reload`": whole,
        "`design` of `reload`": "0 to 4294967295",
        "`source`": "`link` or `converter`",
        "`samples`": "1 to 255, and as many as fit",
        "`inputs`": "1 to 16, with different names",
        "bits": "2 to 32",
        "zero": f"{-gate.MAX_VALUE:g} to {gate.MAX_VALUE:g}",
        "LSB": f"{gate.MIN_LSB:g} to {gate.MAX_VALUE:g}",
        "unit": f"printable text of {gate.MAX_UNIT} characters at most, none of them a control character",
        "bits of `flags`": "0 to 7, each once; with converters, `fault` is one of the flags",
        "`results`": f"missing, or 1 to {MAX_BODY - 1}, so many that a message holds those of a sample; "
        "1 with `packed` or converters",
        "`packed`": "missing, null, or some of the bits of `flags`, in increasing order",
    }
    return "| key | value |\n|---|---|\n" + "".join(f"| {key} | {value} |\n" for key, value in rows.items())


def _refused() -> str:
    text = json.dumps(_board()[0].model_dump(mode="json", exclude={"results"}))
    edits = (
        ('"sample_rate": 100.0', '"sample_rate": 1e-12'),
        ('"name": "gauge"', r'"name": "gauge\u001b[2J"'),
        ('0.00390625, "mm"', r'0.00390625, "m\u0007"'),
        ('0.00390625, "mm"', '1e308, "mm"'),
        ('"channels": 2', '"channels": 2, "channels": 3'),
    )
    rows = []
    for before, after in edits:
        assert text.count(before) == 1
        try:
            Identity.of_memory(text.replace(before, after).encode() + b"\0")
        except LinkError as error:
            rows.append(f"    {before}  becomes  {after}\n        {error}\n")
    assert len(rows) == len(edits)
    return "\n".join(rows)


def _stray() -> str:
    output = _board()[0].output_port
    assert (output.bits, output.signed, output.bytes) == (12, False, 2)
    rows = (
        ("C4 02 03", "code 0x2C4, flags 0 and 1"),
        ("C4 12 03", "damaged: bit 12"),
        ("C4 02 83", "damaged: no flag"),
    )
    return "".join(f"    {data}   {text}\n" for data, text in rows)


def _packed() -> str:
    form = Packing(Port(name="y", bits=16, signed=True, lsb=Fraction(1, 1 << 15), zero=Fraction(0), unit=""), (0, 2, 6))
    rows = bytes.fromhex("01 80 40 FE 7F 05")
    return (
        f"    plain    {_hex(rows)}   code 0x8001, flag 6; code 0x7FFE, flags 0 and 2\n"
        f"    packed   {_hex(form.packed(rows))}     flags {', '.join(map(str, form.flags))}: {form.bits} bits each\n"
    )


def _session() -> str:
    _, board = _board()
    samples = bytes.fromhex("00 08 00 02 10 08 00 02")
    steps = [
        ("begin a session; version 1, window 4", Message(Type.OPEN, 0)),
        ("the first 64 bytes of the identity", Message(Type.IDENTITY, 1, b"\0")),
        (
            "two samples from channel 0 on: codes 0x800 and 0x200, then 0x810 and 0x200",
            Message(Type.SAMPLES, 2, b"\0" + samples),
        ),
        (
            "the same again, as its response was lost: the same bytes, and the samples are not filtered twice",
            Message(Type.SAMPLES, 2, b"\0" + samples),
        ),
        ("a channel that does not exist", Message(Type.SAMPLES, 3, b"\x09" + samples)),
        ("a register of a core without registers", Message(Type.READ, 4, b"\x08")),
        ("a request after one that was lost: no response", Message(Type.COUNTERS, 6)),
        ("the counters", Message(Type.COUNTERS, 5)),
    ]
    lines = []
    for text, message in steps:
        lines.append(f"    {text}\n    > {_hex(message.frame)}\n")
        answer = _hex(board.feed(message.frame))
        lines += [
            f"    {mark} {answer[start : start + 96].rstrip()}\n"
            for mark, start in zip("<" + " " * 9, range(0, len(answer), 96), strict=False)
        ]
    return "\n".join("".join(group) for group in _grouped(lines))


def _grouped(lines: list[str]) -> list[list[str]]:
    groups: list[list[str]] = []
    for line in lines:
        if ">" in line:
            groups.append([])
        groups[-1].append(line)
    return groups


def _throughput() -> str:
    rows = []
    for sample, result in ((4, 3), (2, 3), (4, 2), (8, 5)):
        count = samples_per_message(sample, result)
        request = len(Message(Type.SAMPLES, 0, bytes(1 + count * sample)).frame)
        response = len(Message(Type.SAMPLES | 0x80, 0, bytes(count * result + 1)).frame)
        used = count * max(sample, result) / max(request, response)
        rates = _rates(count, max(request, response))
        rows.append(f"| {sample} | {result} | {count} | {request} | {response} | {100 * used:.1f} % | {rates} |\n")
    for bits, flags in ((16, 3), (12, 3)):
        form = Packing(
            Port(name="y", bits=bits, signed=True, lsb=Fraction(1), zero=Fraction(0), unit=""), tuple(range(flags))
        )
        count = form.per_message(2)
        size = -(-count * form.bits // 8)
        request = len(Message(Type.SAMPLES_PACKED, 0, bytes(1 + count * 2)).frame)
        response = len(Message(Type.SAMPLES_PACKED | 0x80, 0, bytes(size + 1)).frame)
        used = max(2 * count, size) / max(request, response)
        rates = _rates(count, max(request, response))
        rows.append(
            f"| 2 | {form.bits} bits, packed | {count} | {request} | {response} | {100 * used:.1f} % | {rates} |\n"
        )
    head = "| bytes of a sample | of a result | in a message | bytes of the frames | | of the line "
    head += "| samples/s at 1 Mbaud | at 3 Mbaud |\n"
    return head + "|---|---|---|---|---|---|---|---|\n" + "".join(rows)


def _rates(count: int, longest: int) -> str:
    """Return the samples a second at 1 and 3 Mbaud, of frames with `count` of them."""
    return " | ".join(f"{baud / LINE_BITS * count / longest:,.0f}" for baud in (1_000_000, 3_000_000))
