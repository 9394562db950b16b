"""The Tang Nano 20K as an Amaranth platform, which amaranth-boards does not have."""

from __future__ import annotations

from typing import Any

from amaranth.build import Attrs, Clock, Pins, Resource
from amaranth.vendor import GowinPlatform
from amaranth_boards.resources import LEDResources, UARTResource

_LVCMOS33 = Attrs(IO_TYPE="LVCMOS33")


class TangNano20kPlatform(GowinPlatform):  # type: ignore[misc] # Amaranth has no types
    """Clock, LEDs and the UART of its USB bridge; pins from the schematic, as litex-boards has them too."""

    part = "GW2AR-LV18QN88C8/I7"
    family = "GW2AR-18C"
    default_clk = "clk27"
    resources = (
        Resource("clk27", 0, Pins("4", dir="i"), Clock(27e6), _LVCMOS33),
        *LEDResources(pins="15 16 17 18 19 20", invert=True, attrs=_LVCMOS33),
        UARTResource(0, rx="70", tx="69", attrs=Attrs(PULL_MODE="UP", IO_TYPE="LVCMOS33")),
    )
    connectors = ()

    @property
    def _chipdb_device(self) -> str:
        """Name of the die, by which placer and packer know it: the R stands for the memory in its package."""
        return "GW2A-18C"

    def toolchain_prepare(self, fragment: Any, name: str, **kwargs: Any) -> Any:
        """Use the pins of the configuration interfaces, as the board does."""
        return super().toolchain_prepare(fragment, name, gowin_pack_opts="--sspi_as_gpio --mspi_as_gpio", **kwargs)
