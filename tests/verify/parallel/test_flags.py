"""The flags of parallel cores: judged by the codes that the item of a certificate states."""

from __future__ import annotations

import re
from dataclasses import replace
from functools import cache
from types import SimpleNamespace
from typing import Any, cast

import pytest
from tests.verify.parallel.cores import Made, made, specified
from tests.verify.parallel.rejections import rejection
from tests.verify.small_specifications import PLAIN, STEADY_INSTRUMENT
from tests.verify.unit.units import SEVERAL, WORN

from sosmith.gen.core import design_core
from sosmith.verify.certificate_file import AboutEntry, ItemEntry
from sosmith.verify.graph import RejectedError
from sosmith.verify.parallel.flags import wear_limits
from sosmith.verify.parallel.forms import Forms
from sosmith.verify.program.normal_form import constant, scaled


@cache
def core(spec: str, channels: int = 1) -> Made:
    return made(design_core(specified(spec)), channels)


def stated(core: Made, **fields: Any) -> Made:
    """Return a core whose certificate says by what codes its flags are judged."""
    item = {"wear": core.design.datapath.wear, "calibrated": ()} | fields
    about = AboutEntry.model_construct(item=ItemEntry.model_construct(**item))
    return core._replace(certificate=core.certificate.model_copy(update={"about": about}))


@pytest.mark.sweep(1)
@pytest.mark.parametrize(("spec", "channels"), [(PLAIN, 1), (STEADY_INSTRUMENT + WORN, 1), (SEVERAL, 3)])
def test_flags_are_proven(spec: str, channels: int) -> None:
    assert rejection(stated(core(spec, channels)), core(spec, channels).text) == ""


@pytest.mark.slow
def test_other_codes_are_rejected() -> None:
    worn = core(STEADY_INSTRUMENT + WORN)
    ((warning, critical),) = worn.design.datapath.wear
    for fields, said in (
        ({"wear": ((warning, critical + 1),)}, "bit 4 of m_axis_tuser must be wear_critical, as .*"),
        ({"wear": ((warning - 1, critical),)}, "bit 3 of m_axis_tuser must be wear_warning, as .*"),
        ({"wear": ()}, "bit 3 of m_axis_tuser must be 0, as there is no such flag, not another value"),
        ({"calibrated": ((1, 4095), (0, 1023))}, "bit 1 of m_axis_tuser must be outside_calibration, as .*"),
    ):
        assert re.fullmatch(said, rejection(stated(worn, **fields), worn.text))


@pytest.mark.slow
def test_a_range_that_is_not_everything() -> None:
    """The core of a calibration that covers some codes only, as one that is fitted to measurements does."""
    plain = core(STEADY_INSTRUMENT)
    covered = ((100, 4000), (0, 1000))
    quantized = plain.design.quantized
    datapath = replace(quantized.datapath, calibrated=covered)
    narrow = made(replace(plain.design, quantized=replace(quantized, datapath=datapath)))
    assert rejection(stated(narrow, calibrated=covered), narrow.text) == ""
    for other in (((101, 4000), (0, 1000)), ((100, 4001), (0, 1000)), ((100, 4000), (1, 1000)), ()):
        said = rejection(stated(narrow, calibrated=other), narrow.text)
        assert re.fullmatch("bit 1 of m_axis_tuser must be .*", said)


def test_limits_are_read_from_the_word_of_the_channel() -> None:
    """The lower half of a word is the warning, the upper one the limit, both signed or not as the output is."""
    forms = Forms()
    word = forms.variable("word", 0, (1 << 16) - 1)
    words = cast(
        "Any", SimpleNamespace(forms=forms, constant_word=lambda name: word if name == "a.wear_limits" else {})
    )

    def read(wear: Any, *, signed: bool = True, first: Any = (), width: int = 16) -> Any:
        item = None if wear is None else SimpleNamespace(wear=wear)
        certificate = SimpleNamespace(about=SimpleNamespace(item=item), output=SimpleNamespace(bits=8, signed=signed))
        memories = {"a.wear_limits": SimpleNamespace(first=first, width=width)} if first else {}
        netlist = SimpleNamespace(memories=memories)
        return wear_limits(words, cast("Any", netlist), cast("Any", certificate), "a.")

    assert read(None) is read(()) is None
    assert read([(-3, 5)]) == (constant(-3), constant(5))
    wear, right = [(-3, 5), (7, -128)], (0x05FD, 0x8007)
    halves = [forms.floor(scaled(word, -8 * k)) for k in range(2)]
    assert read(wear, first=right) == tuple(forms.signed(half, 8) for half in halves)
    assert read(wear, first=right, signed=False) == tuple(forms.unsigned(half, 8) for half in halves)
    for wrong in ({"first": right[::-1]}, {"first": (0x05FD, 0x8006)}, {"first": right, "width": 17}):
        with pytest.raises(RejectedError, match=r"^a\.wear_limits must hold the limits of all channels$"):
            read(wear, **wrong)
    with pytest.raises(
        RejectedError, match=r"^a core whose channels have limits of their own must have a memory a\.wear_limits$"
    ):
        read(wear)


@pytest.mark.slow
def test_limits_of_the_channel_of_the_sample() -> None:
    several = core(SEVERAL, 3)
    words = several.text.replace("wear_limits[1] = 24'h78", "wear_limits[1] = 24'h79")
    assert rejection(stated(several), words) == "wear_limits must hold the limits of all channels"
    later = re.sub(r"(wear_limits)\[\w+\];", r"\1[judged4];", several.text)
    assert later != several.text
    assert re.fullmatch(r"output_buffer\.\S+ must take over the same .*", rejection(stated(several), later))
