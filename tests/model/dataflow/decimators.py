"""Decimated datapaths."""

from dataclasses import replace

from tests.model.datapaths import INPUT, butterworth, cascade

from sosmith.model.dataflow.datapath import Datapath
from sosmith.model.dataflow.decimator import Decimator


def decimated(factor: int = 8, stages: int = 3, dropped: int = 9) -> Datapath:
    datapath = cascade(butterworth(3, 0.05))
    made = Decimator(input=INPUT, factor=factor, stages=stages, dropped=dropped)
    return replace(datapath, decimator=made, calibrated=())
