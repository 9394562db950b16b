"""The operators of a design, to compute with and to look at."""

from __future__ import annotations

from sosmith.gen.facts.table import Fact, Table, View
from sosmith.gen.word_lengths import cost as counted


class Cost(counted.Cost, View):
    """The same counts, with a table."""

    @classmethod
    def of(cls, cost: counted.Cost) -> Cost:
        """Return the counts of `cost`."""
        return cls(**vars(cost))

    def tables(self) -> list[Table]:
        """Return the operators and what they are estimated to take, before synthesis."""
        rows = [
            Fact("Multiplications", len(self.multiplications), sentence=self.multiplier_sizes),
            Fact("Multiplier blocks", self.multiplier_blocks, sentence="of 18 x 18 bits"),
            Fact("Adder bits", self.adder_bits),
            Fact("Register bits", self.register_bits),
            Fact("LUT4", self.luts, sentence="estimated before synthesis, on an ECP5"),
        ]
        return [Table("Cost of the parallel architecture", rows)]
