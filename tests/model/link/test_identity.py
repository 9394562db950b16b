"""The gate for what a device says of itself: plain names, numbers in ranges, each key once."""

import json
from functools import cache
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from tests.host.lines import device_of
from tests.interface.small import filter_design, instrument_design

import sosmith
from sosmith.gen.output.identity import identity
from sosmith.gen.specification import verilog_names
from sosmith.gen.specification.verilog_names import is_identifier
from sosmith.host.rows import columns
from sosmith.model.errors import LinkError, SpecificationError
from sosmith.model.link import identity as gate
from sosmith.model.link.device import Device
from sosmith.model.link.identity import Identity
from sosmith.model.link.integer_core import IntegerCore


@cache
def memory() -> bytes:
    return device_of(instrument_design())._memory


def tree() -> dict[str, Any]:
    made: dict[str, Any] = json.loads(memory().rstrip(b"\0"))
    return made


def read(changed: dict[str, Any]) -> Identity:
    return Identity.of_memory(json.dumps(changed).encode() + b"\0")


def outcome(changed: dict[str, Any]) -> tuple[Identity | None, str]:
    try:
        return read(changed), ""
    except LinkError as error:
        return None, str(error)


def quantity(place: int, value: Any) -> dict[str, Any]:
    output = tree()["output"]
    return {"output": [*output[:place], value, *output[place + 1 :]]}


def test_the_identity_of_a_board_passes() -> None:
    assert read(tree()) == device_of(instrument_design())._identity


REFUSED = [
    ({"sample_rate": 1e-12}, "sample_rate: Input should be greater than or equal to 0.000001"),
    ({"sample_rate": 1e13}, "sample_rate: Input should be less than or equal to 1000000000000"),
    ({"sample_rate": "100"}, "sample_rate: Input should be a valid number"),
    ({"clock": 0.0}, "clock: Input should be greater than or equal to 0.000001"),
    ({"protocol": 2}, "protocol: Input should be less than or equal to 1"),
    ({"results": 0}, "results: Input should be greater than or equal to 1"),
    (
        {"results": 2, "packed": [0]},
        "text: Several results for each sample should be plain, of a device that is fed over the link",
    ),
    ({"channels": 0}, "channels: Input should be greater than or equal to 1"),
    ({"channels": True}, "channels: Input should be a valid integer"),
    (quantity(4, 1e308), f"output.4: Input should be less than or equal to {10**30}"),
    (quantity(4, 5e-324), f"output.4: Input should be greater than or equal to 0.{1:030}"),
    (quantity(4, 0.0), f"output.4: Input should be greater than or equal to 0.{1:030}"),
    (quantity(3, -1e308), f"output.3: Input should be greater than or equal to -{10**30}"),
    (quantity(1, 33), "output.1: Input should be less than or equal to 32"),
    (quantity(0, "wear\n"), "output.0: String should match pattern '^[A-Za-z_][A-Za-z0-9_]{0,63}$'"),
    (quantity(5, "m\u001b[2J"), "output.5: Text should be printable"),
    (quantity(5, "m" * 17), "output.5: String should have at most 16 characters"),
    (quantity(5, "\u202em"), "output.5: Text should be printable"),
    ({"name": "\u001b]0;owned\u0007"}, "name: String should match pattern '^[A-Za-z_][A-Za-z0-9_]{0,63}$'"),
    ({"name": "../gauge"}, "name: String should match pattern '^[A-Za-z_][A-Za-z0-9_]{0,63}$'"),
    ({"name": "fleet/#"}, "name: String should match pattern '^[A-Za-z_][A-Za-z0-9_]{0,63}$'"),
    ({"name": "a" * 65}, "name: String should match pattern '^[A-Za-z_][A-Za-z0-9_]{0,63}$'"),
    ({"sosmith": "1\r2"}, "sosmith: String should match pattern '^[A-Za-z0-9.+_-]{1,64}$'"),
    (
        {"flags": {"\u001b[2J\n": 0}},
        r"flags.\x1b[2J\n.[key]: String should match pattern '^[A-Za-z_][A-Za-z0-9_]{0,63}$'",
    ),
    ({"flags": {"fault": 8}}, "flags.fault: Input should be less than or equal to 7"),
    ({"flags": {"fault": 0, "settling": 0}}, "text: Bits of flags should differ"),
    ({"inputs": [["x", 8, False, 0.0, 1.0, "V"]] * 2}, "text: Names of inputs should differ"),
    ({"source": "converter", "flags": {}}, "text: Flags of a device with converters should have fault"),
    ({"inputs": []}, "inputs: Tuple should have at least 1 item after validation, not 0"),
    ({"packed": [2, 0]}, "text: Packed flags should be bits of flags, in increasing order"),
    ({"packed": [7]}, "text: Packed flags should be bits of flags, in increasing order"),
    ({"reload": {"design": -1, "words": 1}}, "reload.design: Input should be greater than or equal to 0"),
]


@pytest.mark.parametrize(("change", "fault"), REFUSED)
def test_what_no_identity_says(change: dict[str, Any], fault: str) -> None:
    with pytest.raises(LinkError) as caught:
        read(tree() | change)
    assert str(caught.value) == f"the board's identity must be the JSON of docs/protocol.md, not: {fault}"
    assert str(caught.value).isprintable()


@pytest.mark.parametrize(
    ("before", "after", "key"),
    [
        ('{"protocol"', '{"name":"other","protocol"', "name"),
        ('"flags": {', '"flags": {"fault":7,', "fault"),
        ("}", r',"\u001b":1,"\u001b":2}', r"\x1b"),
    ],
)
def test_each_key_comes_once(before: str, after: str, key: str) -> None:
    head, found, rest = json.dumps(tree()).rpartition(before)
    assert found
    with pytest.raises(LinkError) as caught:
        Identity.of_memory((head + after + rest).encode() + b"\0")
    assert str(caught.value) == f"the board's identity must have each key once, not {key} twice"


def test_keys_of_later_versions_are_left_out() -> None:
    assert read(tree() | {"later": [1, {"a": 2}]}) == read(tree())


@pytest.mark.slow
@given(st.recursive(st.none() | st.floats() | st.integers() | st.text(), st.lists), st.data())
@settings(max_examples=40)
def test_past_the_gate_everything_can_be_shown_and_computed(value: Any, data: st.DataObject) -> None:
    changed = tree()
    place: Any = changed
    key: Any = data.draw(st.sampled_from(sorted(changed)))
    while isinstance(place[key], list | dict) and data.draw(st.booleans()):
        place = place[key]
        key = data.draw(st.sampled_from(sorted(place) if isinstance(place, dict) else range(len(place))))
    place[key] = value
    found, refusal = outcome(changed)
    assert refusal.isprintable()
    if found is None:
        return
    assert all(name.isprintable() for name in (found.name, found.output_port.unit, *columns(found), *found.flags))
    port = found.output_port
    assert np.all(np.isfinite(port.decode(np.array([port.lowest, port.highest])) * found.sample_rate))


@given(st.text(alphabet="aZ_09-$ \n\u00e4", max_size=66))
def test_names_are_those_of_a_specification(name: str) -> None:
    try:
        read(tree() | {"core": name})
    except LinkError:
        assert not is_identifier(name)
    else:
        assert is_identifier(name)


def test_names_are_as_long_as_in_a_specification() -> None:
    assert gate.MAX_NAME == verilog_names.MAX_NAME


def test_the_model_of_a_board_says_nothing_else() -> None:
    core = filter_design().core
    wrong = identity(core, "", baud=1, clock=1.0).model_copy(update={"name": "\u001b"})
    with pytest.raises(LinkError, match=r"^the board's identity must be the JSON of docs/protocol.md, not: name: "):
        Device(wrong, IntegerCore(core.datapath))


def test_no_board_is_made_with_an_identity_that_a_host_refuses() -> None:
    made = sosmith.design(SLOW).core
    expected = "a board must have an identity as in docs/protocol.md, not: sample_rate: Input should be greater than or"
    with pytest.raises(SpecificationError, match=expected):
        identity(made, "", baud=1, clock=1.0)


@pytest.mark.parametrize(
    ("rate", "channels", "baud", "packed"),
    [
        pytest.param(1000, 2, 3_000_000, None, id="plain ones fit"),
        pytest.param(48_000, 2, 3_000_000, (0, 2), id="only packed ones fit"),
        pytest.param(48_000, 3, 3_000_000, None, id="neither fit"),
        pytest.param(48_000, 2, 6_000_000, None, id="a faster line"),
    ],
)
def test_results_are_packed_where_the_line_carries_them_only_so(
    rate: int, channels: int, baud: int, packed: tuple[int, ...] | None
) -> None:
    narrow = {"bits": 16, "range": [-1.0, 1.0], "signed": True}
    made = sosmith.design(
        SLOW
        | {"sample_rate": rate, "channels": channels, "input": {"x": narrow}, "output": narrow}
        | {"filter": {"family": "butterworth", "kind": "lowpass", "order": 1, "cutoff": 100.0}}
    ).core
    found = identity(made, "", baud=baud, clock=25e6)
    assert found.packed == packed
    assert (b'"packed"' in found.memory) is (packed is not None)


def test_all_flags_of_a_core_with_registers_are_packed() -> None:
    narrow = {"bits": 16, "range": [-1.0, 1.0], "signed": True}
    spec = SLOW | {"sample_rate": 96_000, "input": {"x": narrow}, "output": narrow, "hardware": {"reload": True}}
    spec["filter"] = {"family": "butterworth", "kind": "lowpass", "order": 1, "cutoff": 100.0}
    assert identity(sosmith.design(spec).core, "", baud=3_000_000, clock=25e6).packed is None
    narrow["bits"] = 12
    assert identity(sosmith.design(spec).core, "", baud=3_000_000, clock=25e6).packed == tuple(range(7))


SLOW = {
    "name": "slow",
    "sample_rate": 1e-7,
    "input": {"x": {"bits": 8, "range": [-1.0, 1.0], "signed": True}},
    "filter": {"family": "butterworth", "kind": "lowpass", "order": 1, "cutoff": 1e-8},
    "output": {"bits": 8, "range": [-1.0, 1.0], "signed": True},
}
