"""The flags of parallel cores: judged by the codes that the item of a certificate states."""

from __future__ import annotations

import re
from dataclasses import replace
from functools import cache
from typing import Any

import pytest
from tests.verify.parallel.cores import Made, made, specified
from tests.verify.parallel.rejections import rejection
from tests.verify.small_specifications import PLAIN, STEADY_INSTRUMENT
from tests.verify.unit.units import SEVERAL, WORN

from sosmith.gen.core import design_core
from sosmith.verify.certificate_file import AboutEntry, ItemEntry


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


@pytest.mark.slow
def test_limits_of_the_channel_of_the_sample() -> None:
    several = core(SEVERAL, 3)
    words = several.text.replace("wear_limits[1] = 24'h78", "wear_limits[1] = 24'h79")
    assert rejection(stated(several), words) == "wear_limits must hold the limits of all channels"
    later = re.sub(r"(wear_limits)\[\w+\];", r"\1[judged4];", several.text)
    assert later != several.text
    assert re.fullmatch(r"output_buffer\.\S+ must take over the same .*", rejection(stated(several), later))
