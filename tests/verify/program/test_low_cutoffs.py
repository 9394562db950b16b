"""Long programs: filters of high order at low cutoffs, whose words have many digits, are proven, folded and serial."""

import pytest
from tests.gen.designs import EXAMPLES
from tests.verify.program.programs import made, specified

from sosmith.gen.core import design_core

AUDIO = (EXAMPLES / "audio_lowpass.toml").read_text(encoding="utf-8")


@pytest.mark.slow
@pytest.mark.parametrize(
    ("architecture", "order", "cutoff"),
    [
        (architecture, order, cutoff)
        for architecture in ("folded", "serial")
        for order, cutoff in ((9, 4.8), (10, 4.8), (12, 4.8), (10, 2.4))
    ],
)
def test_orders_and_cutoffs(architecture: str, order: int, cutoff: float) -> None:
    text = AUDIO
    for old, new in (
        ("order = 5", f"order = {order}"),
        ("cutoff = 1000.0", f"cutoff = {cutoff}"),
        ('architecture = "auto"', f'architecture = "{architecture}"'),
    ):
        assert old in text
        text = text.replace(old, new)
    core = made(design_core(specified(text)), architecture)
    assert core.check().instructions == len(core.program.instructions)
