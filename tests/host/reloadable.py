"""A core with the registers of docs/registers.md in front of its integer model, which swaps to sets that it knows."""

from __future__ import annotations

import zlib
from collections.abc import Mapping

from sosmith.model.dataflow.datapath import Datapath
from sosmith.model.link.integer_core import IntegerCore
from sosmith.model.reload.registers import CRC, DATA, DESIGN, ID, INTERFACE, LAYOUT, MAGIC, STATUS, VERSION, Outcome


class ReloadableCore:
    """One channel; `sets` are the datapaths by the CRC of their words."""

    def __init__(self, datapath: Datapath, design: int, words: int, sets: Mapping[int, Datapath]) -> None:
        self.core, self.sets = IntegerCore(datapath), sets
        self.corrupt = 0
        self.has_lock = self.locked = False
        self._words = words
        self._loaded: list[int] | None = None
        self._crc = 0
        self._registers = {ID.address: MAGIC, DESIGN.address: design, VERSION.address: 0}
        self._registers[LAYOUT.address] = INTERFACE | words << 16
        self._outcome = Outcome.NONE

    def reset(self) -> None:
        self.core.reset()
        self.locked = False

    def feed(self, channel: int, samples: bytes) -> bytes:
        return self.core.feed(channel, samples)

    def read(self, address: int) -> int | None:
        if address == STATUS.address:
            return int(self._loaded is not None) | self.locked << 3 | self._outcome << 4
        if address == CRC.address:
            return self._crc
        return self._registers.get(address)

    def write(self, address: int, word: int) -> bool:
        if address == STATUS.address and self.has_lock and self._loaded is None:
            self.locked = True
            return True
        if self.locked:
            return False
        if address == VERSION.address:
            self._loaded = [word]
        elif address == DATA.address and self._loaded is not None and len(self._loaded) <= self._words:
            self._loaded.append(word ^ self.corrupt)
        elif address == CRC.address and self._loaded is not None and len(self._loaded) == self._words + 1:
            good = word == self._crc
            self._outcome = Outcome.ACCEPTED if good else Outcome.WRONG_CRC
            if good:
                self.core = IntegerCore(self.sets[word])
                self._registers[VERSION.address] = self._loaded[0]
            self._loaded = None
            return good
        else:
            self._loaded, self._outcome = None, Outcome.BROKEN_OFF
            return False
        self._crc = zlib.crc32(b"".join(each.to_bytes(4, "little") for each in self._loaded))
        return True
